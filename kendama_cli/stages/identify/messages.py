"""Messages that identify logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from kendama_cli.log.messages import ServoMessage, WrenchMessage
from kendama_cli.schema.foxglove import FrameTransform, JointStates


@dataclass(frozen=True)
class JointFrictionMessage:
    """One held-out sample of one joint's friction, and what both models say of it."""

    joint: str
    velocity_rad_s: float
    friction_nm: float
    parametric_nm: float
    network_nm: float


TOPICS: Mapping[str, type] = {
    "/identify/joints": JointStates,
    "/identify/wrench": WrenchMessage,
    "/identify/friction": JointFrictionMessage,
    "/identify/servo": ServoMessage,
    "/identify/tracking/reference": FrameTransform,
    "/identify/tracking/before": FrameTransform,
    "/identify/tracking/after": FrameTransform,
}
"""``before`` and ``after``: the cup on its circle without and with the friction model."""
