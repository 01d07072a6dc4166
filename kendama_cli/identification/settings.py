"""Settings to identify the friction of an arm's joints, and to measure the kendama."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class IdentifySettings:
    """The exciting motions, the models, and the motion of the cup that shows what they are worth."""

    amplitude_rad: float = setting("maximum displacement of each joint from its home posture [rad]", above=0)
    limit_ratio: float = setting("fraction of the speed and acceleration limits that is used", above=0, at_most=1)
    harmonics: int = setting("sines of which each joint's motion is the sum", at_least=1, at_most=20)
    min_speed_rad_s: float = setting("each joint's rate sweeps from about this speed to its fastest [rad/s]", above=0)
    sweeps: int = setting("sweeps of the rate in one motion", at_least=1)
    duration_s: float = setting("length of the motion that is learned from [s]", at_least=4)
    held_out_s: float = setting("length of another motion, on which the two models are compared [s]", at_least=4)
    smoothing_s: float = setting("window of the polynomials that smooth what was measured [s]", above=0, at_most=1)
    hidden_units: int = setting("hidden units of the network, for each joint", at_least=1, at_most=100)
    tracking_speed_m_s: float = setting("speed of the cup on the circle that shows the gain [m/s]", above=0)
    tracking_radius_m: float = setting("radius of that circle, in the swing plane [m]", above=0)
    tracking_laps: int = setting("laps at that speed", at_least=1)


@dataclass(frozen=True)
class SwingMeasurement:
    """The robot swings the ball up, comes to rest, and the ball swings on freely."""

    kind: Literal["swing"]
    reach_deg: float = setting("angle from hanging up to which the ball is swung [deg]", above=0, at_most=88)
    acceleration_m_s2: float = setting("the cup's acceleration meanwhile [m/s^2]", above=0)
    half_width_m: float = setting("the cup stays within this distance of the centre [m]", above=0)
    max_speed_m_s: float = setting("maximum speed of the cup [m/s]", above=0)
    swing_up_s: float = setting("maximum time for that [s]", above=0)
    duration_s: float = setting("duration of the ball's free swing afterwards [s]", above=0)
    rate_hz: float = setting("rate of the samples that are kept [Hz]", above=0)


@dataclass(frozen=True)
class TrackMeasurement:
    """A recorded track of a ball that swings freely about a pivot at rest."""

    kind: Literal["track"]
    path: str | None = setting("file of the track", file=True)
    point: str | None = setting("name of the ball's point; null: the one that moves most")
