"""Messages that predict logs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from kendama_cli.log.messages import DetectionMessage
from kendama_cli.schema.foxglove import CompressedImage, FrameTransform


@dataclass(frozen=True)
class CatchEstimateMessage:
    """Predicted crossing of the rim plane, with its standard deviations and the place's ``covariance_m2`` (9,)."""

    flight: int
    t_catch_s: float
    x_m: float
    y_m: float
    z_m: float
    velocity_x_m_s: float
    velocity_y_m_s: float
    velocity_z_m_s: float
    sigma_t_s: float
    sigma_x_m: float
    sigma_y_m: float
    sigma_z_m: float
    covariance_m2: Collection[float] = ()


@dataclass(frozen=True)
class PredictionErrorMessage:
    """Deviation of the prediction from the true crossing, ``horizon_ms`` before it."""

    flight: int
    horizon_ms: float
    position_error_mm: float
    time_error_ms: float


TOPICS: Mapping[str, type] = {
    "/predict/detection": DetectionMessage,
    "/predict/estimate": CatchEstimateMessage,
    "/predict/error": PredictionErrorMessage,
    "/predict/ball": FrameTransform,
    "/predict/image/*": CompressedImage,
}
"""``*`` stands for the camera's name."""
