"""Messages that fit and offline log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from kendama_cli.log.messages import RolloutMessage


@dataclass(frozen=True)
class PredictionMessage:
    """Angle of the ball in a rollout that no model was fitted to: in the world, and predicted from its start."""

    rollout: int
    world_rad: float
    identified_rad: float
    network_rad: float
    wrong_rad: float


@dataclass(frozen=True)
class PolicySwingMessage:
    """Cup and ball under the frozen policy without noise, in the model or in the ``world``."""

    world: bool
    cup_m: float
    ball_x_m: float
    ball_z_m: float


FIT_TOPICS: Mapping[str, type] = {"/fit/prediction": PredictionMessage}
OFFLINE_TOPICS: Mapping[str, type] = {"/offline/rollout": RolloutMessage, "/offline/swing": PolicySwingMessage}
