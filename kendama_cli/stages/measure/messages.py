"""Messages that measure logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from kendama_cli.log.messages import JointExchangeMessage


@dataclass(frozen=True)
class FreeSwingMessage:
    """The ball in the plane of its swing about the fitted pivot, as it was seen and as the fitted pendulum has it."""

    x_m: float
    z_m: float
    fitted_x_m: float
    fitted_z_m: float


TOPICS: Mapping[str, type] = {"/measure/exchange": JointExchangeMessage, "/measure/swing": FreeSwingMessage}
