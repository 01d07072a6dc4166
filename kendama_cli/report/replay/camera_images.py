"""Camera images of a motion, which a replay shows beside the scene."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import cv2
import numpy as np

from kendama_cli.log.messages import DetectionMessage
from kendama_cli.schema.foxglove import CompressedImage

if TYPE_CHECKING:  # a process that renders a film reads no log
    import pandas as pd

    from kendama_cli.report.source import StageLog

_MOST_BYTES = 900_000
"""Of all images of one motion."""
_SAME_S = 5e-3
"""A detection so near to an image is of that image."""


@dataclass(frozen=True)
class CameraImages:
    """The images of one camera, ``size_px`` wide and high: when each was taken, its file, and where the ball was found.

    ``t_s`` (n,), ``files`` (n,) in ``format`` (jpeg or png), ``balls`` (n,) as (u, v, radius) [px] or None.
    """

    camera: str
    format: str
    size_px: tuple[int, int]
    t_s: tuple[float, ...]
    files: tuple[bytes, ...]
    balls: tuple[tuple[float, float, float] | None, ...]


def camera_images(
    log: StageLog, under: str, *, start_s: float = -math.inf, end_s: float = math.inf
) -> tuple[CameraImages, ...]:
    """Return the images below ``under``/image from ``start_s`` to ``end_s``, evenly thinned if they weigh too much.

    Cameras whose images cannot be decoded are left out.
    """
    prefix = f"{under}/image/"
    found = log.table(f"{under}/detection", DetectionMessage)
    kept = {}
    for topic in log.topics_under(prefix):
        images = log.table(topic, CompressedImage)
        kept[topic.removeprefix(prefix)] = images[(images["t_s"] > start_s) & (images["t_s"] <= end_s)]
    total = sum(int(images["data"].map(len).sum()) for images in kept.values())
    step = math.ceil(total / _MOST_BYTES)
    made = (_of_camera(camera, images.iloc[:: max(step, 1)], found) for camera, images in kept.items() if len(images))
    return tuple(one for one in made if one is not None)


def _of_camera(camera: str, images: pd.DataFrame, found: pd.DataFrame) -> CameraImages | None:
    files = [bytes(data) for data in images["data"]]
    decoded = cast("np.ndarray | None", cv2.imdecode(np.frombuffer(files[0], np.uint8), cv2.IMREAD_GRAYSCALE))
    if decoded is None:
        return None
    seen = found[(found["camera"] == camera) & found["seen"].astype(bool)] if len(found) else found
    times = images["t_s"].to_numpy(np.float64)
    return CameraImages(
        camera,
        "png" if images["format"].iloc[0] == "png" else "jpeg",
        (decoded.shape[1], decoded.shape[0]),
        tuple(times.tolist()),
        tuple(files),
        tuple(_ball_at(seen, t_s) for t_s in times.tolist()),
    )


def _ball_at(seen: pd.DataFrame, t_s: float) -> tuple[float, float, float] | None:
    if seen.empty:
        return None
    apart = np.abs(seen["t_s"].to_numpy(np.float64) - t_s)
    row = int(apart.argmin())
    if apart[row] > _SAME_S:
        return None
    u_px, v_px, radius_px = (float(seen[name].iloc[row]) for name in ("u_px", "v_px", "radius_px"))
    return u_px, v_px, radius_px
