"""Messages that identify and measure log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from kendama_cli.log.messages import JointExchangeMessage, ServoMessage, WrenchMessage
from kendama_cli.schema.foxglove import FrameTransform, JointStates


@dataclass(frozen=True)
class JointFrictionMessage:
    """One held-out sample of one joint's friction, and what both models say of it."""

    joint: str
    velocity_rad_s: float
    friction_nm: float
    parametric_nm: float
    network_nm: float


@dataclass(frozen=True)
class FreeSwingMessage:
    """The ball in the plane of its swing about the fitted pivot, as it was seen and as the fitted pendulum has it."""

    x_m: float
    z_m: float
    fitted_x_m: float
    fitted_z_m: float


FRICTION_TOPICS: Mapping[str, type] = {
    "/identify/joints": JointStates,
    "/identify/wrench": WrenchMessage,
    "/identify/friction": JointFrictionMessage,
    "/identify/servo": ServoMessage,
    "/identify/tracking/reference": FrameTransform,
    "/identify/tracking/before": FrameTransform,
    "/identify/tracking/after": FrameTransform,
}
"""``before`` and ``after``: the cup on its circle without and with the friction model."""

SWING_TOPICS: Mapping[str, type] = {"/measure/exchange": JointExchangeMessage, "/measure/swing": FreeSwingMessage}
