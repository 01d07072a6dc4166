"""The task of the swing-up: goal, rewards, workspace, noise, validation, engine, counting."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

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

    angle_deg: float = setting("desired angle of the ball from hanging, on either side [deg]", above=0, at_most=180)
    tolerance_deg: float = setting("allowed deviation of the angle [deg]", above=0)
    min_rate_rad_s: float = setting("minimum angular velocity away from hanging [rad/s]")
    max_rate_rad_s: float = setting("maximum angular velocity away from hanging [rad/s]")
    success: Literal["caught", "catchable", "reached"] = setting(
        "'caught': released there and caught; 'catchable': there with a catch predicted within reach; 'reached': there"
    )
    slack_s: float = setting("the ball is released once the rope has been slack for so long [s]", above=0)
    landing_limit_m: float = setting(
        "maximum |x| at which the freely flying ball may come down to the rim to be catchable [m]", above=0
    )
    catch_acceleration_m_s2: float = setting(
        "maximum acceleration with which the cup goes to meet the ball [m/s^2]", above=0
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

    goal: float = setting("reward of success")
    missed: float = setting("reward of a release whose ball just misses the cup; it falls to 0 with the distance")
    missed_range_m: float = setting("distance from the cup at which a miss is worth nothing any more [m]", above=0)
    timeout: float = setting("reward when time is up")
    outside: float = setting("reward on leaving the workspace (only where that ends the rollout)")
    step: float = setting("reward of each action")
    displacement_per_m: float = setting("penalty of each action per metre of |x| beyond the free range", at_least=0)
    displacement_free_m: float = setting("|x| up to which displacement costs nothing [m]", at_least=0)


@dataclass(frozen=True)
class LimitedWorkspace:
    """A braking limiter keeps the cup inside: it always leaves enough distance to stop."""

    kind: Literal["limit"]
    half_width_m: float = setting("the cup stays within this distance of the centre [m]", above=0)
    max_speed_m_s: float = setting("maximum speed of the cup [m/s]", above=0)
    braking_m_s2: float = setting("deceleration that the limiter counts on; below the maximum action [m/s^2]", above=0)


@dataclass(frozen=True)
class TerminatingWorkspace:
    """Leaving the workspace ends the rollout with the reward 'outside'; only the speed is limited."""

    kind: Literal["terminate"]
    half_width_m: float = setting("leaving this distance of the centre ends the rollout [m]", above=0)
    max_speed_m_s: float = setting("maximum speed of the cup [m/s]", above=0)


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
class RailEngine:
    """The cup on a rail, compiled: its acceleration is what is commanded, and the ball is a point on a rope."""

    kind: Literal["rail"]


@dataclass(frozen=True)
class DartEngine:
    """The world of the whole arm in DART: line, drive and controller carry the cup, the ball touches cup and arm."""

    kind: Literal["dart"]
    robot: RobotSettings


EngineSettings = DartEngine | RailEngine
"""What computes the dynamics, distinguished by ``kind``."""


@dataclass(frozen=True)
class RandomisationSettings:
    """Domain randomisation (Tobin et al. 2017): how bodies differ; values are uniform, new in every rollout."""

    rope: float = setting("+- relative error of the rope's length", at_least=0, below=0.5)
    drag: tuple[float, float] = setting("range of a factor on the air's drag", at_least=0)
    noise: tuple[float, float] = setting("range of a factor on all noise", at_least=0)
    acceleration: float = setting("+- relative error of all accelerations of a rollout", at_least=0, below=0.5)
    angle_deg: float = setting("+- offset of all readings of the ball's angle in a rollout [deg]", at_least=0)
    delay_s: float = setting("an acceleration takes effect up to so much later [s]", at_least=0)
    workspace_shrink: float = setting(
        "the workspace is narrower by a fraction up to this, and slower, as for a longer rope", at_least=0, below=0.5
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
    engine: EngineSettings | None = setting("engine of the dynamics of these rollouts; null: learn.engine")


@dataclass(frozen=True)
class CountSettings:
    """Rule by which the swing-up counts as learned, and limits of its rollouts (kendama_cli/learning/statistics.py)."""

    learned_streak: int = setting("greedy successes in a row that count as learned", above=0)
    max_rollouts: int = setting("rollouts after which learning has failed", above=0)
    solved_streak: int = setting(
        "greedy successes in a row that count as solved, when the policy is frozen; until then, or max_rollouts, "
        "learning continues",
        above=0,
    )
    evaluation_rollouts: int = setting("rollouts of the frozen policy", above=0)

    def __post_init__(self) -> None:
        for key in ("solved_streak", "max_rollouts"):
            if getattr(self, key) < self.learned_streak:
                raise ConfigError(
                    key,
                    f"'{key}' is {getattr(self, key)}; allowed: at least learned_streak, which is "
                    f"{self.learned_streak}",
                )
