"""A few images of a camera, with the circle where the ball was found."""

from __future__ import annotations

import base64

import cv2
import numpy as np
import pandas as pd

from kendama_cli.log.messages import DetectionMessage
from kendama_cli.report.figure import Panel
from kendama_cli.report.source import StageLog
from kendama_cli.schema.foxglove import CompressedImage

_THUMBNAILS = 4
_MOST_IMAGE_BYTES = 1_200_000
_TRAIL, _RING = "#ffe14d", "#00e5ff"  # on the image, whatever the page's colours


def thumbnails(log: StageLog, stage: str) -> Panel | None:
    """Return a few frames of the first camera, evenly over the detections, with the circle where the ball was found.

    ``stage`` is what the topics begin with: ``/predict`` or ``/transfer``.
    """
    under = f"{stage}/image/"
    topics = log.topics_under(under)
    if not topics:
        return None
    camera = topics[0].removeprefix(under)
    images = log.table(topics[0], CompressedImage)
    found = log.table(f"{stage}/detection", DetectionMessage)
    if images.empty:
        return None
    seen = found[(found["camera"] == camera) & found["seen"]] if len(found) else found
    if len(seen):  # one flight only: the one of the images
        near = np.abs(seen["t_s"].to_numpy()[:, None] - images["t_s"].to_numpy()[None, :]).min(axis=1)
        seen = seen[seen["flight"] == seen["flight"].iloc[int(near.argmin())]].sort_values("t_s")
        in_flight = images["t_s"].between(seen["t_s"].iloc[0] - 1e-6, seen["t_s"].iloc[-1] + 1e-6)
        images = images[in_flight] if in_flight.any() else images
    picked = np.unique(np.linspace(0, len(images) - 1, _THUMBNAILS).round().astype(int))
    cells: list[str] = []
    total = 0
    zero_s = float(seen["t_s"].iloc[-1] if len(seen) else images["t_s"].iloc[-1])
    for row in picked:
        image = images.iloc[row]
        total += len(image["data"])
        if total <= _MOST_IMAGE_BYTES and (cell := _thumbnail(image, seen, zero_s, near=bool(cells))):
            cells.append(cell)
    return Panel(f"Camera “{camera}”", f'<div class="thumbs">{"".join(cells)}</div>') if cells else None


def _thumbnail(image: pd.Series, seen: pd.DataFrame, zero_s: float, *, near: bool) -> str:
    """Return one camera image with the trail and the circle; ``near`` cuts out the surroundings of the trail.

    Its time counts from ``zero_s``.
    Empty where the image cannot be decoded.
    """
    data = bytes(image["data"])
    decoded = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
    if decoded is None:
        return ""
    height, width = decoded.shape
    left, top, wide = _cut(seen, width, height) if near and len(seen) else (0.0, 0.0, float(width))
    marks, caption = "", f"{1e3 * (image['t_s'] - zero_s):.0f} ms".replace("-", "−")
    if len(seen):
        trail = "L".join(f"{u:.1f} {v:.1f}" for u, v in seen[["u_px", "v_px"]].to_numpy(np.float64).tolist())
        marks = f'<path d="M{trail}" fill="none" stroke="{_TRAIL}" stroke-width="{wide / 260:.2f}" opacity=".9"/>'
        nearest = seen.iloc[int((seen["t_s"] - image["t_s"]).abs().to_numpy().argmin())]
        if abs(nearest["t_s"] - image["t_s"]) < 5e-3:
            ring = nearest["radius_px"] + wide / 120
            marks += (
                f'<circle cx="{nearest["u_px"]:.1f}" cy="{nearest["v_px"]:.1f}" r="{ring:.1f}" fill="none" '
                f'stroke="{_RING}" stroke-width="{wide / 160:.2f}"/>'
            )
            caption += f": ball at ({nearest['u_px']:.1f}, {nearest['v_px']:.1f}) px"
    kind = "png" if image["format"] == "png" else "jpeg"
    box = f"{left:.1f} {top:.1f} {wide:.1f} {wide * height / width:.1f}"
    return (
        f'<div><svg viewBox="{box}" role="img" aria-label="Camera image with the detected ball">'
        f'<image width="{width}" height="{height}" href="data:image/{kind};base64,{base64.b64encode(data).decode()}"/>'
        f"{marks}</svg><p>{caption}</p></div>"
    )


def _cut(seen: pd.DataFrame, width: int, height: int) -> tuple[float, float, float]:
    """Return the left, top and width [px] of the part of the image around the trail, in the image's proportions."""
    u, v = seen["u_px"].to_numpy(np.float64), seen["v_px"].to_numpy(np.float64)
    wide = min(float(width), 1.5 * max(float(np.ptp(u)), float(np.ptp(v)) * width / height, width / 6))
    tall = wide * height / width
    left = float(np.clip((u.min() + u.max() - wide) / 2, 0, width - wide))
    return left, float(np.clip((v.min() + v.max() - tall) / 2, 0, height - tall)), wide
