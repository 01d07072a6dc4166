"""Settings to identify the friction of an arm's joints, and to measure the kendama."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class IdentifySettings:
    """Exciting motions, friction models, and a motion of the cup that tests the compensation."""

    amplitude_rad: float = setting("Maximum displacement of each joint from its home position [rad].", above=0)
    limit_ratio: float = setting(
        "The motions use up to this fraction of the joints' velocity and acceleration limits.", above=0, at_most=1
    )
    harmonics: int = setting("Each joint's motion is a sum of this many sines.", at_least=1, at_most=20)
    min_speed_rad_s: float = setting(
        "The peak velocity of each joint sweeps from about this value to its maximum [rad/s]. It must be low enough "
        "to show the Stribeck effect.",
        above=0,
    )
    sweeps: int = setting("Number of sweeps from slow to fast in one motion.", at_least=1)
    duration_s: float = setting("Duration of the motion to which the friction models are fitted [s].", at_least=4)
    held_out_s: float = setting("Duration of a second motion on which the two models are compared [s].", at_least=4)
    smoothing_s: float = setting(
        "Window of the polynomials that smooth the measured joint angles [s]. A larger window removes more noise and "
        "more detail.",
        above=0,
        at_most=1,
    )
    hidden_units: int = setting(
        "Number of hidden units of the friction network, for each joint.", at_least=1, at_most=100
    )
    tracking_speed_m_s: float = setting(
        "Speed of the cup on the circle that compares tracking before and after compensation [m/s].", above=0
    )
    tracking_radius_m: float = setting("Radius of that circle, in the swing plane [m].", above=0)
    tracking_laps: int = setting("Number of laps of the circle.", at_least=1)


@dataclass(frozen=True)
class SwingMeasurement:
    """The robot swings the ball up, comes to rest, and the ball swings on freely."""

    kind: Literal["swing"]
    reach_deg: float = setting("The robot swings the ball up to this angle from hanging [deg].", above=0, at_most=88)
    acceleration_m_s2: float = setting("Acceleration of the cup during the swing-up [m/s^2].", above=0)
    half_width_m: float = setting("The cup stays within this distance of its start during the swing-up [m].", above=0)
    max_speed_m_s: float = setting("Maximum speed of the cup during the swing-up [m/s].", above=0)
    swing_up_s: float = setting("Maximum duration of the swing-up [s].", above=0)
    duration_s: float = setting("Duration of the free swing that follows and is measured [s].", above=0)
    rate_hz: float = setting("Rate of the samples that are stored [Hz].", above=0)


@dataclass(frozen=True)
class TrackMeasurement:
    """A recorded track of a ball that swings freely about a pivot at rest."""

    kind: Literal["track"]
    path: str | None = setting("File of the recorded track.", file=True)
    point: str | None = setting("Name of the ball's point in the track; null takes the point that moves most.")
