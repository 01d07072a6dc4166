"""Settings of the transfer: policy and primitive on the hardware, learning there, and full games."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class ObservationSettings:
    """Settings of the observation: the policy's state from tracked cup and ball, and the flight."""

    samples_n: int = setting("readings from which position, angle and their rates are fitted", at_least=2)
    source: Literal["cameras", "tracking"] = setting("observer of the flight: images, or the robot's own tracking")
    observe_from_deg: float = setting(
        "the test for free flight runs while the rope rises beyond this angle [deg]", at_least=0, below=180
    )
    processing_s: float = setting(
        "virtual cameras: from the end of the exposure to the image's estimate [s]", at_least=0
    )
    camera_origin: Literal["line", "world"] = setting(
        "cameras: their poses count from the line's centre (the rope's tie point there), or are in the world"
    )
    image_every: int = setting("cameras: log every so many frames of the first game as whole images", at_least=1)
    position_sigma_m: float = setting("tracking: standard deviation of a position, per axis [m]", above=0)
    free_after_s: float = setting("tracking: the ball counts as flying this long after the goal [s]", at_least=0)
    max_sigma_m: float = setting(
        "the cup follows estimates that are better than this; before, the last swing state's landing [m]", above=0
    )


@dataclass(frozen=True)
class CatchSettings:
    """Settings of the interception of the ball by the cup."""

    acceleration_m_s2: float = setting("largest acceleration of the cup [m/s^2]", above=0)
    max_speed_m_s: float = setting("largest speed of the cup [m/s]", above=0)
    half_width_m: float = setting("the cup stays within this distance of the line's centre [m]", above=0)
    matching: float = setting(
        "part of the ball's horizontal speed that the cup wants to have at the catch", at_least=0, at_most=1
    )
    below_rim_m: float = setting("the cup is aimed at where the ball's centre is this far below the rim [m]")
    max_tilt_rad: float = setting(
        "the cup tilts against the ball's velocity relative to it up to this; 0: it stays upright [rad]",
        at_least=0,
        at_most=0.8,
    )
    contact_speed_m_s: float = setting("speed downward with which the cup meets the ball [m/s]", at_least=0, at_most=1)
    contact_braking_m_s2: float = setting("deceleration of that after the catch [m/s^2]", above=0)
    freeze_before_catch_s: float = setting("the plan is frozen for this long before the catch [s]", above=0)
    braking_m_s2: float = setting("deceleration of the cup after the catch [m/s^2]", above=0)
    after_catch_s: float = setting("the game ends this long after the predicted catch [s]", above=0)


@dataclass(frozen=True)
class TransferSettings:
    """Settings of the steps of the transfer."""

    policy: str | None = setting(
        "artifact.json of a stored policy to take instead of the learn stage's, verified like it", file=True
    )
    evaluation_rollouts: int = setting(
        "rollouts of the frozen policy, before and again after learning on the hardware", above=0
    )
    max_rollouts: int = setting(
        "rollouts after which learning on the hardware ends without its streak of successes", above=0
    )
    solved_streak: int = setting(
        "greedy successes in a row at which the policy is frozen; until then learning continues "
        "(never fewer than learn.count.learned_streak)",
        above=0,
    )
    baseline: bool = setting("let the same robot also learn from an empty table, to compare with")
    imitation_attempts: int = setting("plays of the imitation motion at most; after a miss its tau is varied", above=0)
    imitation_repeats: int = setting(
        "further plays at the tau that caught: imitation_caught_rate is theirs", at_least=0
    )
    imitation_tau_step: float = setting("step of that variation, as a fraction of tau", above=0, below=0.1)
    games: int = setting("full games: swing-up, flight, catch", above=0)
    log_period_s: float = setting("steps, joints and transforms are logged this often [s]", above=0)
    observation: ObservationSettings = setting("observation of ball and cup")
    catch: CatchSettings = setting("method of the catch")
