"""Messages that transfer logs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from kendama_cli.log.messages import (
    DetectionMessage,
    JointExchangeMessage,
    ReplayMessage,
    RolloutMessage,
    ServoMessage,
    WrenchMessage,
)
from kendama_cli.schema.foxglove import CompressedImage, FrameTransform, FrameTransforms, JointStates, SceneUpdate


@dataclass(frozen=True)
class TransferStepMessage:
    """State that the policy acted on in one control period; negative ``rollout`` -1 - i: game i."""

    rollout: int
    x_m: float
    velocity_m_s: float
    angle_rad: float
    rate_rad_s: float
    action_m_s2: float


@dataclass(frozen=True)
class GameMessage:
    """Result of one game; nan for what never came, ``crossing_m`` empty if the ball did not cross the rim plane."""

    index: int
    swung_up: bool
    predicted: bool
    caught: bool
    prediction_error_mm: float
    outcome: str
    since_s: float
    free_s: float
    frames: int
    seen: int
    latency_frames: float
    blow_n: float
    crossing_s: float
    crossing_m: Collection[float]


@dataclass(frozen=True)
class GameEstimateMessage:
    """Predicted crossing of the rim plane in one game; ``covariance_m2`` (9,) of the place, row by row."""

    game: int
    t_catch_s: float
    sigma_t_s: float
    x_m: float
    y_m: float
    z_m: float
    velocity_x_m_s: float
    velocity_y_m_s: float
    velocity_z_m_s: float
    covariance_m2: Collection[float]


@dataclass(frozen=True)
class ImitationMessage:
    """Attempt ``index`` at the imitation: its aim, where the ball came down (nan without a descent), and the outcome.

    The aim is the miss along x that the model predicts for the motion, ``along_m``, and the shift of its goal in
    flight; nan for the motion as planned. ``led`` is False before the arm's servo was known that led later attempts.
    ``bent`` are the changes of its parameters by a search, in their first standard deviations; empty for an aim.
    ``outcome`` are the words that told it, empty where the miss was measured; ``path_m`` are the least and the largest
    predicted miss of the motions that were simulated, empty before there were any.
    """

    index: int
    along_m: float
    shift_x_m: float
    shift_y_m: float
    caught: bool
    miss_x_m: float
    miss_y_m: float
    apex_m: float
    led: bool
    outcome: str
    path_m: Collection[float]
    bent: Collection[float]


TOPICS: Mapping[str, type] = {
    "/transfer/step": TransferStepMessage,
    "/transfer/rollout": RolloutMessage,
    "/transfer/scratch/rollout": RolloutMessage,
    "/transfer/scene": SceneUpdate,
    "/transfer/links": FrameTransforms,
    "/transfer/exchange": JointExchangeMessage,
    "/transfer/joints": JointStates,
    "/transfer/cup": FrameTransform,
    "/transfer/ball": FrameTransform,
    "/transfer/detection": DetectionMessage,
    "/transfer/estimate": GameEstimateMessage,
    "/transfer/game": GameMessage,
    "/transfer/replay": ReplayMessage,
    "/transfer/wrench": WrenchMessage,
    "/transfer/imitation/rollout": ImitationMessage,
    "/transfer/imitation/links": FrameTransforms,
    "/transfer/imitation/cup": FrameTransform,
    "/transfer/imitation/ball": FrameTransform,
    "/transfer/imitation/wrench": WrenchMessage,
    "/transfer/servo": ServoMessage,
    "/transfer/image/*": CompressedImage,
}
"""``*`` stands for the camera's name."""
