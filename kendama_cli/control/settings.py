"""Settings of the transfer: policy and primitive on the hardware, learning there, and full games."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class ObservationSettings:
    """Settings of the observation: the policy's state from tracked cup and ball, and the flight."""

    samples_n: int = setting(
        "Position, angle and their rates are fitted to this many readings. More readings reduce noise and add delay.",
        at_least=2,
    )
    source: Literal["cameras", "tracking"] = setting(
        "Sensor of the ball's flight: 'cameras' uses images, 'tracking' the ball's position that the robot reports."
    )
    observe_from_deg: float = setting(
        "The test for free flight runs while the ball rises beyond this angle from hanging [deg].",
        at_least=0,
        below=180,
    )
    processing_s: float = setting(
        "Virtual cameras deliver an image's estimate this long after the end of its exposure [s].", at_least=0
    )
    camera_origin: Literal["line", "world"] = setting(
        "Origin of the cameras' poses: 'line' is the rope's tie point at the centre of the line, 'world' the world's "
        "origin."
    )
    image_every: int = setting("One image in this many of the first game is logged.", at_least=1)
    position_sigma_m: float = setting("Standard deviation of a tracked position, per axis [m].", above=0)
    free_after_s: float = setting(
        "With tracking, the ball counts as flying this long after the swing-up has reached its goal [s].", at_least=0
    )
    max_sigma_m: float = setting(
        "The cup follows a predicted landing point once its standard deviation is below this [m]. Until then it "
        "follows the landing point that the last state of the swing predicts.",
        above=0,
    )


@dataclass(frozen=True)
class CatchSettings:
    """Settings of the interception of the ball by the cup."""

    acceleration_m_s2: float = setting("Maximum acceleration of the cup [m/s^2].", above=0)
    max_speed_m_s: float = setting("Maximum speed of the cup [m/s].", above=0)
    half_width_m: float = setting("The cup stays within this distance of the line's centre [m].", above=0)
    matching: float = setting(
        "Fraction of the ball's horizontal velocity that the cup should have at the catch. 1 meets the ball without a "
        "horizontal impact.",
        at_least=0,
        at_most=1,
    )
    below_rim_m: float = setting(
        "The ball's centre is this far below the rim at the point where the cup is to meet it [m]."
    )
    max_tilt_rad: float = setting(
        "The cup tilts by up to this to face the approaching ball [rad]. 0 keeps it upright.", at_least=0, at_most=0.8
    )
    contact_speed_m_s: float = setting(
        "The cup moves down with this speed when it meets the ball [m/s]. A larger value softens the impact.",
        at_least=0,
        at_most=1,
    )
    contact_braking_m_s2: float = setting(
        "After the catch the downward motion brakes with this deceleration [m/s^2].", above=0
    )
    freeze_before_catch_s: float = setting(
        "The planned catch no longer changes during this time before it [s].", above=0
    )
    braking_m_s2: float = setting("After the catch the cup brakes with this deceleration [m/s^2].", above=0)
    after_catch_s: float = setting("The game ends this long after the predicted catch [s].", above=0)


@dataclass(frozen=True)
class TransferSettings:
    """Settings of the steps of the transfer."""

    policy: str | None = setting(
        "File artifact.json of a stored policy that replaces the learn stage's and is verified in the same way; null "
        "takes the learn stage's.",
        file=True,
    )
    servo: str | None = setting(
        "Log of an earlier transfer or 'identify' of this arm, RUN/STAGE or a file, by whose servo commands lead from "
        "the first rollout on; null takes the identify stage's, else it is found in the first rollout.",
        file=True,
        log=True,
        absent=None,
    )
    evaluation_rollouts: int = setting(
        "The frozen policy is evaluated in this many rollouts before it learns on the hardware, and in as many "
        "afterwards.",
        above=0,
    )
    max_rollouts: int = setting(
        "Learning on the hardware ends after this many rollouts, even without a streak of successes.", above=0
    )
    solved_streak: int = setting(
        "The policy is frozen after this many greedy successes in a row; until then it learns. It never takes fewer "
        "than learn.count.learned_streak.",
        above=0,
    )
    baseline: bool = setting("If true, the same robot also learns from an empty table, for comparison.")
    imitation_attempts: int = setting(
        "The imitation is played at most this often. After a miss the motion is aimed by where the ball came down; "
        "where four steps in a row help little, CMA-ES searches its shape.",
        above=0,
    )
    outcome: str = setting(
        "Source of the outcome of each imitation: 'measured' by the robot's tracking of cup and ball; 'ask' asks at "
        "the prompt; else a file to which any program appends a line, such as 'caught' or 'little short'."
    )
    imitation_repeats: int = setting(
        "The motion that caught is played up to this many times more, which gives imitation_caught_rate.", at_least=0
    )
    games: int = setting("Maximum number of full games: swing-up, flight and catch.", above=0)
    thorough: bool = setting("If true, all repeats and games are played; else they may end where their rate is clear.")
    log_period_s: float = setting("Steps, joints and transforms are logged at this interval [s].", above=0)
    observation: ObservationSettings = setting("Observation of ball and cup.")
    catch: CatchSettings = setting("Interception of the ball by the cup.")
