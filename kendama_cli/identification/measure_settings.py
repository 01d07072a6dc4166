"""Settings to measure the kendama: by a swing that a robot starts, or from a track."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class SwingMeasurement:
    """The robot swings the ball up, comes to rest, and the ball swings on freely."""

    kind: Literal["swing"]
    reach_deg: float = setting("angle from hanging up to which the ball is swung [deg]", above=0, at_most=88)
    acceleration_m_s2: float = setting("the cup's acceleration meanwhile [m/s^2]", above=0)
    half_width_m: float = setting("the cup stays within this distance of the middle [m]", above=0)
    max_speed_m_s: float = setting("largest speed of the cup [m/s]", above=0)
    swing_up_s: float = setting("longest time for that [s]", above=0)
    duration_s: float = setting("duration of the ball's free swing afterwards [s]", above=0)
    rate_hz: float = setting("rate of the samples that are kept [Hz]", above=0)


@dataclass(frozen=True)
class TrackMeasurement:
    """A recorded track of a ball that swings freely about a pivot at rest."""

    kind: Literal["track"]
    path: str | None = setting("file of the track", file=True)
    point: str | None = setting("name of the ball's point; null: the one that moves most")
