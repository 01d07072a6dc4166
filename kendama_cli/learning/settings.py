"""Learning the swing-up: state bins, actions, goal, reward, exploration, workspace, noise (PAPER.md, Reinforcement)."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


def _check_rising(key: str, edges: Sequence[float]) -> None:
    for low, high in itertools.pairwise(edges):
        if not high > low:
            raise ConfigError(key, f"'{key}' must rise from value to value; {high} follows {low}")


@dataclass(frozen=True)
class GridSettings:
    """How the plain state falls into bins: n edges cut a line into n + 1 bins, n equal bins cut the circle."""

    position: Literal["side", "distance", "mirrored"] = setting(
        "'side' bins the cup's position x, 'distance' bins |x| from the middle of the workspace, 'mirrored' bins |x| "
        "and turns left and right about where x < 0"
    )
    position_edges_m: tuple[float, ...] = setting("edges between the bins of the cup's position [m]")
    velocity_edges_m_s: tuple[float, ...] = setting("edges between the bins of the cup's velocity [m/s]")
    angle_bins: int = setting(
        "equal bins of the ball's angle over the full circle, the first centred on hanging", above=0
    )
    rate_edges_rad_s: tuple[float, ...] = setting("edges between the bins of the ball's angular velocity [rad/s]")

    def __post_init__(self) -> None:
        for key in ("position_edges_m", "velocity_edges_m_s", "rate_edges_rad_s"):
            _check_rising(key, getattr(self, key))


@dataclass(frozen=True)
class DecisionSettings:
    """When a new action is chosen: as soon as the binned state has changed, within these limits."""

    shortest_s: float = setting("an action is held at least this long [s]", above=0)
    longest_s: float = setting("a new action is chosen after this long even in the same binned state [s]", above=0)

    def __post_init__(self) -> None:
        if self.longest_s < self.shortest_s:
            raise ConfigError(
                "longest_s",
                f"'longest_s' is {self.longest_s}; allowed: at least shortest_s, which is {self.shortest_s}",
            )


@dataclass(frozen=True)
class GoalSettings:
    """The state that ends the swing-up: the ball high on either side, still rising, and within reach of a catch."""

    angle_deg: float = setting("wanted angle of the ball from hanging, on either side [deg]", above=0, at_most=180)
    tolerance_deg: float = setting("allowed deviation of the angle [deg]", above=0)
    slowest_rad_s: float = setting("least angular velocity away from hanging [rad/s]")
    fastest_rad_s: float = setting("largest angular velocity away from hanging [rad/s]")
    catchable: bool = setting("whether a catch must also be possible from there, by the two limits below")
    landing_limit_m: float = setting(
        "largest |x| at which the freely flying ball may come down to the rim [m]", above=0
    )
    catch_acceleration_m_s2: float = setting(
        "largest constant acceleration of the cup that meets the ball there [m/s^2]", above=0
    )

    def __post_init__(self) -> None:
        if self.fastest_rad_s <= self.slowest_rad_s:
            raise ConfigError(
                "fastest_rad_s",
                f"'fastest_rad_s' is {self.fastest_rad_s}; allowed: above slowest_rad_s, which is {self.slowest_rad_s}",
            )


@dataclass(frozen=True)
class RewardSettings:
    """Reward of the final state, of each action and of displacement."""

    goal: float = setting("reward on reaching the goal")
    timeout: float = setting("reward when time is up")
    outside: float = setting("reward on leaving the workspace (only where that ends the rollout)")
    step: float = setting("reward of each action")
    displacement_per_m: float = setting("penalty of each action per metre of |x| beyond the free range", at_least=0)
    displacement_free_m: float = setting("|x| up to which displacement costs nothing [m]", at_least=0)


@dataclass(frozen=True)
class ScheduleSettings:
    """When a rollout explores: until the first success, and from then on by chance after a greedy failure."""

    after_failure: float = setting(
        "probability that the rollout after a greedy failure explores", at_least=0, at_most=1
    )


@dataclass(frozen=True)
class HarmonicExploration:
    """A harmonic A cos(w t + phase) drives the whole rollout, w, A and the phase drawn anew (PAPER.md)."""

    kind: Literal["harmonic"]
    schedule: ScheduleSettings
    band_rad_s: tuple[float, float] = setting("range of the angular frequency w [rad/s]", above=0)
    amplitude: tuple[float, float] = setting(
        "range of A as a fraction of the largest action, or of the workspace's half width", above=0
    )
    drives: Literal["acceleration", "position", "suited"] = setting(
        "what of the cup is the harmonic; 'suited': the acceleration where a limiter keeps the cup inside, else the "
        "position"
    )
    phase: Literal["quarter", "any"] = setting("'quarter': +-pi/2, it starts from zero; 'any': uniform")
    bang_bang: bool = setting("whether only the sign of the wanted acceleration is kept, at the largest action")

    def __post_init__(self) -> None:
        for key in ("band_rad_s", "amplitude"):
            low, high = getattr(self, key)
            if not 0 < low <= high:
                raise ConfigError(key, f"'{key}' is [{low}, {high}]; allowed: [low, high] with 0 < low <= high")


@dataclass(frozen=True)
class EpsilonGreedyExploration:
    """Each action of an exploring rollout is random with probability epsilon / (1 + k / decay) in rollout k."""

    kind: Literal["epsilon_greedy"]
    schedule: ScheduleSettings
    epsilon: float = setting("probability of a random action in the first rollout", at_least=0, at_most=1)
    decay_rollouts: float = setting("rollouts after which epsilon is halved", above=0)


ExplorationSettings = HarmonicExploration | EpsilonGreedyExploration


@dataclass(frozen=True)
class LimitedWorkspace:
    """A braking limiter keeps the cup inside: it always leaves room to stop."""

    kind: Literal["limit"]
    half_width_m: float = setting("the cup stays within this distance of the middle [m]", above=0)
    max_speed_m_s: float = setting("largest speed of the cup [m/s]", above=0)
    braking_m_s2: float = setting("deceleration that the limiter counts on; below the largest action [m/s^2]", above=0)


@dataclass(frozen=True)
class TerminatingWorkspace:
    """Leaving the workspace ends the rollout with the reward 'outside'; only the speed is limited."""

    kind: Literal["terminate"]
    half_width_m: float = setting("leaving this distance of the middle ends the rollout [m]", above=0)
    max_speed_m_s: float = setting("largest speed of the cup [m/s]", above=0)


WorkspaceSettings = LimitedWorkspace | TerminatingWorkspace


@dataclass(frozen=True)
class NoiseSettings:
    """Standard deviations of what differs from rollout to rollout and from reading to reading."""

    start_angle_deg: float = setting("ball's angle at the start of a rollout [deg]", at_least=0)
    start_position_m: float = setting("cup's position at the start of a rollout [m]", at_least=0)
    angle_reading_deg: float = setting("each reading of the ball's angle [deg]", at_least=0)
    rate_reading_rad_s: float = setting("each reading of the ball's angular velocity [rad/s]", at_least=0)
    acceleration: float = setting("relative error of each action's acceleration", at_least=0, below=0.25)


@dataclass(frozen=True)
class ValidationSettings:
    """What differs while the learned table is put to the proof, as another body would: drawn anew for each rollout."""

    noise: float = setting("factor on all noise, uniform from 0 up to this", above=0)
    acceleration: float = setting("uniform +- relative error of all accelerations of a rollout", at_least=0, below=0.5)
    angle_deg: float = setting("uniform +- offset of all readings of the ball's angle in a rollout [deg]", at_least=0)
    narrowing: float = setting(
        "the workspace is narrower by a share up to this, uniform, and slower, as for a longer rope",
        at_least=0,
        below=0.5,
    )


@dataclass(frozen=True)
class CountSettings:
    """When the swing-up counts as learned, and how long is tried (kendama_cli/learning/statistics.py)."""

    streak: int = setting("greedy successes in a row that count as learned", above=0)
    cap: int = setting("rollouts after which learning has failed", above=0)
    settled: int = setting(
        "greedy successes in a row at which the table is frozen; until then, or the cap, learning goes on", above=0
    )
    evaluation: int = setting("rollouts of the frozen greedy policy", above=0)

    def __post_init__(self) -> None:
        for key in ("settled", "cap"):
            if getattr(self, key) < self.streak:
                raise ConfigError(
                    key, f"'{key}' is {getattr(self, key)}; allowed: at least streak, which is {self.streak}"
                )


@dataclass(frozen=True)
class LearnSettings:
    """SARSA(lambda) on a table of binned states and accelerations of the cup."""

    grid: GridSettings
    decision: DecisionSettings
    goal: GoalSettings
    reward: RewardSettings
    exploration: ExplorationSettings
    workspace: WorkspaceSettings
    noise: NoiseSettings
    proof: ValidationSettings
    count: CountSettings
    engine: Literal["dart", "kernel"] = setting(
        "what computes the dynamics: DART, or compiled code that gives the same numbers much faster"
    )
    alpha: float = setting("learning rate of the first rollout", above=0, at_most=1)
    alpha_decay_rollouts: float = setting("rollouts after which the learning rate is halved", above=0)
    gamma: float = setting("discount from action to action", at_least=0, at_most=1)
    trace_decay: float = setting("lambda of the eligibility traces", at_least=0, at_most=1)
    update: Literal["sarsa", "expected_sarsa", "q", "double_sarsa"] = setting("what a choice is told to be worth")
    traces: Literal["replacing", "accumulating", "dutch"] = setting("what a visit makes of a trace")
    initial_q: float = setting("value of every entry of the table before learning")
    replay_passes: int = setting("times that a finished rollout is gone through again", at_least=0)
    actions_m_s2: tuple[float, ...] = setting("accelerations of the cup to choose from, rising [m/s^2]")
    rollout_s: float = setting("longest duration of a rollout [s]", above=0)
    step_s: float = setting("time step of the dynamics and of the readings [s]", above=0)

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
        if self.update == "double_sarsa" and self.traces == "dutch":
            raise ConfigError(
                "traces", "'traces' is 'dutch'; allowed with update double_sarsa: replacing, accumulating"
            )
        weaker = min(-self.actions_m_s2[0], self.actions_m_s2[-1])
        if isinstance(self.workspace, LimitedWorkspace) and self.workspace.braking_m_s2 > weaker:
            raise ConfigError(
                "workspace.braking_m_s2",
                f"'workspace.braking_m_s2' is {self.workspace.braking_m_s2}; allowed: at most the largest action to "
                f"either side, {weaker}",
            )
        if self.step_s > self.decision.shortest_s:
            raise ConfigError(
                "step_s", f"'step_s' is {self.step_s}; allowed: at most decision.shortest_s, {self.decision.shortest_s}"
            )
        if self.rollout_s < self.decision.longest_s:
            raise ConfigError(
                "rollout_s",
                f"'rollout_s' is {self.rollout_s}; allowed: at least decision.longest_s, {self.decision.longest_s}",
            )

    @property
    def largest_action_m_s2(self) -> float:
        """The larger of the two extreme accelerations [m/s^2]."""
        return max(-self.actions_m_s2[0], self.actions_m_s2[-1])

    def with_room(self, factor: float) -> LearnSettings:
        """The same with ``factor`` times the room, as a rope 1 / ``factor`` times as long sees it in the model's size.

        The half width and the goal's landing limit are lengths, the largest speed goes with the root of one.
        """
        workspace = replace(
            self.workspace,
            half_width_m=factor * self.workspace.half_width_m,
            max_speed_m_s=math.sqrt(factor) * self.workspace.max_speed_m_s,
        )
        goal = replace(self.goal, landing_limit_m=factor * self.goal.landing_limit_m)
        return replace(self, workspace=workspace, goal=goal)
