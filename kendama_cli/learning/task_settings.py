"""The task of the swing-up: goal, rewards, workspace, noise, validation, engine, counting."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.artifacts.proportion import Evaluation
from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting
from kendama_cli.settings.robot import RobotSettings


@dataclass(frozen=True)
class GoalSettings:
    """The window in which the swing-up may end, the ball high on either side and still rising, and what ends it.

    ``success`` is what has to happen. 'caught': the rope is slack for ``slack_s`` within the window, and after the
    flight that follows, under the cup's own limits, the ball falls into the cup. 'catchable': the state lies in the
    window, and a catch is predicted to be within reach as if the rope were slack. 'reached': the window alone.
    """

    angle_deg: float = setting("Desired angle of the ball from hanging, on either side [deg].", above=0, at_most=180)
    tolerance_deg: float = setting(
        "Maximum deviation from the desired angle [deg]. A larger value makes the task easier.", above=0
    )
    min_rate_rad_s: float = setting("Minimum angular velocity of the ball away from hanging [rad/s].")
    max_rate_rad_s: float = setting("Maximum angular velocity of the ball away from hanging [rad/s].")
    success: Literal["caught", "catchable", "reached"] = setting(
        "Condition of success in the goal's window. 'caught' needs a release and a catch, 'catchable' a predicted "
        "catch within reach, and 'reached' the window alone."
    )
    slack_s: float = setting("The ball is released once the rope has been slack for this long [s].", above=0)
    landing_limit_m: float = setting(
        "A ball is catchable if it comes down to the rim within this distance of the centre [m].", above=0
    )
    catch_acceleration_m_s2: float = setting(
        "Maximum acceleration of the cup when it moves to catch the ball [m/s^2].", above=0
    )

    def __post_init__(self) -> None:
        if self.max_rate_rad_s <= self.min_rate_rad_s:
            raise ConfigError(
                "max_rate_rad_s",
                f"'max_rate_rad_s' is {self.max_rate_rad_s}; allowed: above min_rate_rad_s, which is "
                f"{self.min_rate_rad_s}",
            )


@dataclass(frozen=True)
class RewardSettings:
    """Reward of the final state, of each action and of displacement."""

    goal: float = setting("Reward of success.")
    missed: float = setting("Reward of a release whose ball only just misses the cup. It falls to 0 with the distance.")
    missed_range_m: float = setting("Distance from the cup at which the reward of a miss has fallen to 0 [m].", above=0)
    timeout: float = setting("Reward when the time of the rollout is up.")
    outside: float = setting("Reward for leaving the workspace, if that ends the rollout.")
    step: float = setting("Reward of each action. A negative value favours short rollouts.")
    displacement_per_m: float = setting(
        "Penalty of each action per metre that the cup is beyond the free range.", at_least=0
    )
    displacement_free_m: float = setting("The cup has no penalty within this distance of the centre [m].", at_least=0)


@dataclass(frozen=True)
class LimitedWorkspace:
    """A braking limiter keeps the cup inside: it always leaves enough distance to stop."""

    kind: Literal["limit"]
    half_width_m: float = setting("The cup stays within this distance of the centre [m].", above=0)
    max_speed_m_s: float = setting("Maximum speed of the cup [m/s].", above=0)
    braking_m_s2: float = setting(
        "Deceleration that the limiter relies on to stop the cup in the workspace; it must be below the maximum "
        "action [m/s^2].",
        above=0,
    )


@dataclass(frozen=True)
class TerminatingWorkspace:
    """Leaving the workspace ends the rollout with the reward 'outside'; only the speed is limited."""

    kind: Literal["terminate"]
    half_width_m: float = setting("The rollout ends when the cup is farther than this from the centre [m].", above=0)
    max_speed_m_s: float = setting("Maximum speed of the cup [m/s].", above=0)


WorkspaceSettings = LimitedWorkspace | TerminatingWorkspace


@dataclass(frozen=True)
class NoiseSettings:
    """Standard deviations of what differs from rollout to rollout and from reading to reading."""

    start_angle_deg: float = setting(
        "Standard deviation of the ball's angle at the start of a rollout [deg].", at_least=0
    )
    start_position_m: float = setting(
        "Standard deviation of the cup's position at the start of a rollout [m].", at_least=0
    )
    angle_reading_deg: float = setting("Standard deviation of each reading of the ball's angle [deg].", at_least=0)
    rate_reading_rad_s: float = setting(
        "Standard deviation of each reading of the ball's angular velocity [rad/s].", at_least=0
    )
    acceleration: float = setting(
        "Standard deviation of the relative error of each action's acceleration.", at_least=0, below=0.25
    )


@dataclass(frozen=True)
class FlightSensorSettings:
    """Sensor of the evaluation's second catch: the flying ball's position with noise, at a camera's rate, and late."""

    rate_hz: float = setting("The flying ball is measured this often [Hz].", above=0, at_most=1000)
    sigma_m: float = setting("Standard deviation of its measured position along x and z [m].", above=0)
    latency_s: float = setting("Time from a measurement to the command that uses it [s].", at_least=0)


@dataclass(frozen=True)
class RailEngine:
    """The cup on a rail, compiled: its acceleration is what is commanded, and the ball is a point on a rope."""

    kind: Literal["rail"]


@dataclass(frozen=True)
class DartEngine:
    """Simulation of the whole arm in DART: line, drive and controller move the cup; the ball touches cup and arm."""

    kind: Literal["dart"]
    robot: RobotSettings


EngineSettings = DartEngine | RailEngine
"""What computes the dynamics, distinguished by ``kind``."""


@dataclass(frozen=True)
class RandomisationSettings:
    """Domain randomisation (Tobin et al. 2017): each rollout samples another kendama and arm, uniformly."""

    rope: float = setting(
        "The rope's length differs from the model by up to this fraction, either way.", at_least=0, below=0.5
    )
    drag: tuple[float, float] = setting("Range of a factor on the air drag.", at_least=0)
    noise: tuple[float, float] = setting("Range of a factor on all noise.", at_least=0)
    acceleration: float = setting(
        "All accelerations of a rollout differ from the commanded ones by up to this fraction, either way.",
        at_least=0,
        below=0.5,
    )
    angle_deg: float = setting(
        "All readings of the ball's angle in a rollout are off by up to this, either way [deg].", at_least=0
    )
    delay_s: float = setting("Accelerations take effect up to this much later [s].", at_least=0)
    workspace_shrink: float = setting(
        "The workspace is narrower and its maximum speed lower by up to this fraction, as with a longer rope.",
        at_least=0,
        below=0.5,
    )

    def __post_init__(self) -> None:
        for key in ("drag", "noise"):
            low, high = getattr(self, key)
            if low > high:
                raise ConfigError(key, f"'{key}' is [{low}, {high}]; allowed: [low, high] with low <= high")


@dataclass(frozen=True)
class ValidationSettings:
    """The rollouts that validate a learned policy, without learning, before it is frozen."""

    randomisation: RandomisationSettings
    engine: EngineSettings | None = setting("Physics engine of these rollouts; null takes learn.engine.")


@dataclass(frozen=True)
class CountSettings:
    """Rule by which the swing-up counts as learned, and limits of its rollouts (kendama_cli/learning/statistics.py)."""

    learned_streak: int = setting("The swing-up counts as learned after this many greedy successes in a row.", above=0)
    max_rollouts: int = setting("Learning fails after this many rollouts.", above=0)
    solved_streak: int = setting(
        "The swing-up counts as solved after this many greedy successes in a row, and the policy is final. Until "
        "then, or until max_rollouts, learning continues.",
        above=0,
    )
    evaluation_rollouts: int = setting("The frozen policy is evaluated in at most this many rollouts.", above=0)
    thorough: bool = setting(
        "If true, evaluations play all their rollouts, repeats and games; else they may end after a third, where the "
        "rate is clear by then."
    )

    def __post_init__(self) -> None:
        for key in ("solved_streak", "max_rollouts"):
            if getattr(self, key) < self.learned_streak:
                raise ConfigError(
                    key,
                    f"'{key}' is {getattr(self, key)}; allowed: at least learned_streak, which is "
                    f"{self.learned_streak}",
                )

    @property
    def evaluation(self) -> Evaluation:
        """Evaluation of the frozen policy."""
        return Evaluation(self.evaluation_rollouts, self.thorough)
