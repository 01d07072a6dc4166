"""Learning the swing-up: state bins, actions, exploration and the task (equations.md, Swing-up)."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal, Protocol

from kendama_cli.errors import ConfigError
from kendama_cli.learning.task_settings import (
    CountSettings,
    EngineSettings,
    FlightSensorSettings,
    GoalSettings,
    LimitedWorkspace,
    NoiseSettings,
    RandomisationSettings,
    RewardSettings,
    ValidationSettings,
    WorkspaceSettings,
)
from kendama_cli.schema.registry import Registry
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class SarsaSettings:
    """SARSA(lambda) and its kin on a table of values; ``learn.alpha``, ``learn.gamma`` and so on are its constants."""

    kind: Literal["sarsa"]


@dataclass(frozen=True)
class RandomReplaySettings:
    """The baseline: harmonics are sampled until one succeeds, and that one is replayed without a table."""

    kind: Literal["random_replay"]
    after_failure: float = setting(
        "Probability of sampling a new harmonic after a failed replay.", at_least=0, at_most=1
    )


@dataclass(frozen=True)
class RandomSettings:
    """Random baseline: every rollout samples a harmonic, and none is stored."""

    kind: Literal["random"]


@dataclass(frozen=True)
class EnergyPumpingSettings:
    """A hand-written controller that pumps energy into the ball and keeps the cup near the centre; it learns nothing.

    With the energy E of the ball over hanging still (per mass, [J/kg]) and its desired value E* = g l (1 + height),

        a = -gain (E* - E) cos(angle - lead) sign(rate) - stiffness x - damping v,

    clipped to the maximum action.
    """

    kind: Literal["energy_pumping"]
    height: float = setting("Desired height of the ball's turning point above the tie point, in rope lengths.")
    gain: float = setting(
        "Acceleration per missing energy (per mass) [1/m]. A larger gain swings the ball up faster.", above=0
    )
    lead_rad: float = setting("Phase by which the pumping leads the ball's angle [rad].")
    braking: float = setting("Fraction of the gain that removes excess energy.", at_least=0)
    stiffness_per_s2: float = setting(
        "Stiffness of the spring that pulls the cup to the centre, per mass [1/s^2].", at_least=0
    )
    damping_per_s: float = setting("Damping of the cup, per mass [1/s].", at_least=0)


LEARNERS = Registry("kendama.learners", "learner")


class LearnerSettings(Protocol):
    """Fields that the settings of every learner have beside fields of their own."""

    @property
    def kind(self) -> str:
        """Return the name under which the learner is registered."""


@dataclass(frozen=True)
class HarmonicSettings:
    """A harmonic A cos(w t + phase) drives the whole rollout, all three sampled at random (equations.md)."""

    band_rad_s: tuple[float, float] = setting("Range of the angular frequency w [rad/s].", above=0)
    amplitude: tuple[float, float] = setting(
        "Range of A as a fraction of the maximum action, or of the half width if the position is driven.", above=0
    )
    drives: Literal["acceleration", "position", "auto"] = setting(
        "Quantity of the cup that follows the harmonic; 'auto': the acceleration with a limiter, else the position."
    )
    phase: Literal["quarter", "any"] = setting(
        "Phase of the harmonic: 'quarter' is pi/2 or -pi/2, which starts from zero; 'any' is uniform."
    )
    bang_bang: bool = setting("If true, the cup accelerates at the maximum action with the harmonic's sign.")

    def __post_init__(self) -> None:
        for key in ("band_rad_s", "amplitude"):
            low, high = getattr(self, key)
            if not 0 < low <= high:
                raise ConfigError(key, f"'{key}' is [{low}, {high}]; allowed: [low, high] with 0 < low <= high")


@dataclass(frozen=True)
class ExplorationSettings:
    """Settings of the exploring rollouts of a table: until the first success, and later at random after a failure.

    'harmonic': a harmonic of ``learn.harmonic`` drives the whole rollout. It is sampled anew, or mutated slightly from
    one with the highest rewards so far. 'epsilon_greedy': each action is random with probability
    epsilon / (1 + k / decay) in rollout k.
    """

    kind: Literal["harmonic", "epsilon_greedy"] = setting(
        "Exploration by a harmonic for the whole rollout, or by epsilon-greedy actions."
    )
    after_failure: float = setting(
        "Probability that the rollout after a greedy failure explores.", at_least=0, at_most=1
    )
    in_a_row: int = setting("After such a failure, this many rollouts explore in a row.", above=0)
    mutation_fraction: float = setting(
        "Fraction of harmonics that mutate one of the best so far; others are sampled anew.", at_least=0, at_most=1
    )
    amplitude_spread: float = setting(
        "Standard deviation of the factor by which a mutation scales the amplitude.", at_least=0, below=0.5
    )
    frequency_spread: float = setting(
        "Standard deviation of the factor by which a mutation scales the frequency.", at_least=0, below=0.5
    )
    spread_scales: tuple[float, float] = setting(
        "Until the first success, range of a factor on both spreads (sampled on a logarithmic scale).",
        above=0,
        at_most=10,
    )
    elite_size: int = setting(
        "This many harmonics with the highest rewards so far are candidates for mutation.", above=0
    )
    epsilon: float = setting("Probability of a random action in the first rollout.", at_least=0, at_most=1)
    decay_rollouts: float = setting("Epsilon has halved after this many rollouts.", above=0)

    def __post_init__(self) -> None:
        low, high = self.spread_scales
        if low > high:
            raise ConfigError("spread_scales", f"'spread_scales' is [{low}, {high}]; allowed: [low, high], low <= high")


def _check_rising(key: str, edges: Sequence[float]) -> None:
    for low, high in itertools.pairwise(edges):
        if not high > low:
            raise ConfigError(key, f"'{key}' must rise from value to value; {high} follows {low}")


@dataclass(frozen=True)
class GridSettings:
    """Bins of the plain state: n edges cut a line into n + 1 bins, n equal bins cut the circle."""

    position: Literal["side", "distance", "mirrored"] = setting(
        "Binned position: x ('side'), |x| ('distance'), or |x| with the state mirrored at x < 0 ('mirrored')."
    )
    position_edges_m: tuple[float, ...] = setting("Edges between the bins of the cup's position [m].")
    velocity_edges_m_s: tuple[float, ...] = setting("Edges between the bins of the cup's velocity [m/s].")
    angle_bins: int = setting(
        "Number of equal bins of the ball's angle over the circle; the first is centred on hanging.", above=0
    )
    rate_edges_rad_s: tuple[float, ...] = setting("Edges between the bins of the ball's angular velocity [rad/s].")

    def __post_init__(self) -> None:
        for key in ("position_edges_m", "velocity_edges_m_s", "rate_edges_rad_s"):
            _check_rising(key, getattr(self, key))


@dataclass(frozen=True)
class DecisionSettings:
    """Limits of the time of a decision: a new action is chosen once the binned state has changed, within these."""

    min_s: float = setting("An action is held for at least this long [s].", above=0)
    max_s: float = setting("A new action is chosen after this long even in the same binned state [s].", above=0)

    def __post_init__(self) -> None:
        if self.max_s < self.min_s:
            raise ConfigError("max_s", f"'max_s' is {self.max_s}; allowed: at least min_s, which is {self.min_s}")


@dataclass(frozen=True)
class LearnSettings:
    """The task, the learner, and the constants of a table over binned states and accelerations of the cup."""

    learner: Annotated[LearnerSettings, LEARNERS]
    grid: GridSettings
    decision: DecisionSettings
    goal: GoalSettings
    reward: RewardSettings
    harmonic: HarmonicSettings
    exploration: ExplorationSettings
    workspace: WorkspaceSettings
    noise: NoiseSettings
    sensor: FlightSensorSettings
    randomisation: RandomisationSettings
    validation: ValidationSettings
    count: CountSettings
    engine: EngineSettings
    task: str = setting("Name of the task. A stored policy is refused if the configuration has another task.")
    alpha: float = setting(
        "Learning rate of the first rollout. Larger values learn faster and forget faster.", above=0, at_most=1
    )
    alpha_decay_rollouts: float = setting("The learning rate has halved after this many rollouts.", above=0)
    gamma: float = setting(
        "Discount factor per action. Values near 1 give distant rewards more weight.", at_least=0, at_most=1
    )
    trace_decay: float = setting(
        "Decay lambda of the eligibility traces. 0 updates the last action only, 1 the whole rollout.",
        at_least=0,
        at_most=1,
    )
    traces: Literal["pair", "state"] = setting(
        "Eligibility traces of a table: of each pair of state and action ('pair'), or of each state, whose last action "
        "they belong to ('state')."
    )
    update: Literal["sarsa", "q"] = setting(
        "Target of the update: the value of the next action ('sarsa') or of the best one ('q')."
    )
    acting: Literal["latest", "streak_mean"] = setting(
        "Values that choose actions: the 'latest', or the 'streak_mean' after the successes of the current streak."
    )
    initial_q: float = setting("All entries of the table have this value before learning.")
    replay_passes: int = setting(
        "A finished rollout is replayed this many times to update the table again.", at_least=0
    )
    actions_m_s2: tuple[float, ...] = setting(
        "Accelerations of the cup that the policy chooses from, in rising order [m/s^2]."
    )
    rollout_s: float = setting("Maximum duration of a rollout [s].", above=0)
    step_s: float = setting("Time step of the dynamics and of the readings [s].", above=0)

    def __post_init__(self) -> None:
        _check_rising("actions_m_s2", self.actions_m_s2)
        if len(self.actions_m_s2) < 2 or not self.actions_m_s2[0] < 0 < self.actions_m_s2[-1]:
            raise ConfigError(
                "actions_m_s2",
                f"'actions_m_s2' is {list(self.actions_m_s2)}; allowed: at least one negative and one positive value",
            )
        if self.grid.position == "mirrored" and any(
            low != -high for low, high in zip(self.actions_m_s2, reversed(self.actions_m_s2), strict=True)
        ):
            raise ConfigError(
                "actions_m_s2",
                f"'actions_m_s2' is {list(self.actions_m_s2)}; allowed where 'grid.position' is mirrored: with each "
                "value its negative",
            )
        weaker = min(-self.actions_m_s2[0], self.actions_m_s2[-1])
        if isinstance(self.workspace, LimitedWorkspace) and self.workspace.braking_m_s2 > weaker:
            raise ConfigError(
                "workspace.braking_m_s2",
                f"'workspace.braking_m_s2' is {self.workspace.braking_m_s2}; allowed: at most the maximum action to "
                f"either side, {weaker}",
            )
        for key, bodies in (
            ("randomisation", self.randomisation),
            ("validation.randomisation", self.validation.randomisation),
        ):
            if bodies.delay_s > self.decision.min_s:
                raise ConfigError(
                    f"{key}.delay_s",
                    f"'{key}.delay_s' is {bodies.delay_s}; allowed: at most decision.min_s, {self.decision.min_s}",
                )
        if self.step_s > self.decision.min_s:
            raise ConfigError(
                "step_s", f"'step_s' is {self.step_s}; allowed: at most decision.min_s, {self.decision.min_s}"
            )
        if self.rollout_s < self.decision.max_s:
            raise ConfigError(
                "rollout_s",
                f"'rollout_s' is {self.rollout_s}; allowed: at least decision.max_s, {self.decision.max_s}",
            )

    @property
    def max_action_m_s2(self) -> float:
        """The larger of the two extreme accelerations [m/s^2]."""
        return max(-self.actions_m_s2[0], self.actions_m_s2[-1])

    def with_workspace_scale(self, factor: float) -> LearnSettings:
        """Return the settings with a workspace ``factor`` times as wide.

        A rope 1 / ``factor`` times as long, scaled to the model's rope, meets the workspace so. The half width and the
        goal's landing limit are lengths; the maximum speed goes with the root of a length.
        """
        workspace = replace(
            self.workspace,
            half_width_m=factor * self.workspace.half_width_m,
            max_speed_m_s=math.sqrt(factor) * self.workspace.max_speed_m_s,
        )
        goal = replace(self.goal, landing_limit_m=factor * self.goal.landing_limit_m)
        return replace(self, workspace=workspace, goal=goal)
