"""Messages that the stage tempo logs; only the standard library is imported."""

from dataclasses import dataclass


@dataclass(frozen=True)
class TempoMessage:
    tau_scale: float
    peak_speed_m_s: float
    allowed: bool


TOPICS = {"/tempo/scale": TempoMessage}
