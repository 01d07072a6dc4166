"""Settings to excite and fit the friction that an arm's controller does not know, and to show that it is
compensated.
"""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class IdentifySettings:
    """The exciting motions, the models, and the motion of the cup that shows what they are worth."""

    amplitude_rad: float = setting("maximum displacement of each joint from its home posture [rad]", above=0)
    limit_ratio: float = setting("share of the speed and acceleration limits that is used", above=0, at_most=1)
    harmonics: int = setting("sines of which each joint's motion is the sum", at_least=1, at_most=20)
    min_speed_rad_s: float = setting("each joint's tempo sweeps from about this speed to its fastest [rad/s]", above=0)
    sweeps: int = setting("sweeps of the tempo in one motion", at_least=1)
    duration_s: float = setting("length of the motion that is learned from [s]", at_least=4)
    held_out_s: float = setting("length of another motion, on which the two models are compared [s]", at_least=4)
    smoothing_s: float = setting("window of the polynomials that smooth what was measured [s]", above=0, at_most=1)
    hidden_units: int = setting("hidden units of the network, for each joint", at_least=1, at_most=100)
    tracking_speed_m_s: float = setting("speed of the cup on the circle that shows the gain [m/s]", above=0)
    tracking_radius_m: float = setting("radius of that circle, in the swing plane [m]", above=0)
    tracking_laps: int = setting("laps at that speed", at_least=1)
