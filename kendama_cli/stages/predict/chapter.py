"""The figures of predict: what the camera saw, what was made of it, and how far off the predicted catch was."""

from __future__ import annotations

import base64

import cv2
import numpy as np
import pandas as pd

from kendama_cli.log.messages import DetectionMessage
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import BALL, CUP, OTHER
from kendama_cli.schema.foxglove import CompressedImage
from kendama_cli.stages.predict.messages import CatchEstimateMessage, PredictionErrorMessage

_THUMBNAILS = 4
_MOST_IMAGE_BYTES = 1_200_000
_TRAIL, _RING = "#ffe14d", "#00e5ff"  # on the image, whatever the page's colours


def prediction_figures(log: StageLog) -> list[Figure]:
    """Camera images with the detection; the error against the horizon; one estimate as it settles."""
    errors = log.table("/predict/error", PredictionErrorMessage)
    film = thumbnails(log, "/predict")
    study = [
        error_panel(errors, "position_error_mm", "Position of the catch"),
        error_panel(errors, "time_error_ms", "Time of the catch"),
        _convergence(log.table("/predict/estimate", CatchEstimateMessage)),
    ]
    n = errors["flight"].nunique() if len(errors) else 0
    return [
        *figure(
            [
                "What the camera saw of one flight, and where the image processing found the ball (ring); the line"
                " joins all detections of the flight. The first image is whole, the others are cut out around the line."
            ],
            [film],
            columns=1,
        ),
        *figure(
            lettered(
                study,
                [
                    f"Error of the predicted crossing of the rim plane over the time left until it, {n} flights:"
                    " median, half of all flights (dark) and 90 % of them (light).",
                    "The same for the time of the crossing.",
                    "One flight: distance of each estimate from the last one, and the uncertainty (one sigma) that it"
                    " states.",
                ],
            ),
            study,
            columns=3,
        ),
    ]


def error_panel(errors: pd.DataFrame, column: str, title: str) -> Panel | None:
    """Quantile bands of |error| over the horizon."""
    if errors.empty:
        return None
    errors = errors[np.isfinite(errors[column].to_numpy(np.float64))]
    if errors.empty:
        return None
    horizon = errors["horizon_ms"].round(3)
    if horizon.nunique() > 40:  # every flight has its own: groups of like horizons, about 15 flights each
        groups = int(np.clip(len(errors) // 15, 4, 15))
        rank = (horizon.rank(method="first") - 1) * groups // len(errors)
        horizon = horizon.groupby(rank).transform("median")
    spread = errors[column].abs().groupby(horizon).quantile(np.array([0.05, 0.25, 0.5, 0.75, 0.95])).unstack()
    at = spread.index.to_numpy(np.float64)
    unit = column.rsplit("_", 1)[1]
    with drawing(f"predict-{unit}", f"{title}: error against the horizon", width_in=3.4, height_in=2.6) as made:
        axes = made.axes()[0]
        axes.fill_between(at, spread[0.05], spread[0.95], color=CUP, alpha=0.15, lw=0, label="90 %")
        axes.fill_between(at, spread[0.25], spread[0.75], color=CUP, alpha=0.32, lw=0, label="50 %")
        axes.plot(at, spread[0.5], "o-", color=CUP, ms=3.2, lw=1.3, label="median")
        axes.invert_xaxis()
        axes.set_ylim(bottom=0)
        axes.set_xlabel("time left to the catch [ms]")
        axes.set_ylabel(f"error [{unit}]")
        legend_above(axes)
    return Panel(title, made.svg)


def _convergence(estimates: pd.DataFrame) -> Panel | None:
    """Distance from the last estimate, and the stated sigma, over the time left, for the longest flight."""
    if estimates.empty:
        return None
    flight = estimates["flight"].value_counts(sort=False).sort_index().idxmax()
    one = estimates[estimates["flight"] == flight].sort_values("t_s")
    if len(one) < 3:
        return None
    points = one[["x_m", "y_m", "z_m"]].to_numpy(np.float64)
    sigma = np.linalg.norm(one[["sigma_x_m", "sigma_y_m", "sigma_z_m"]].to_numpy(np.float64), axis=1)
    left_ms = 1e3 * (float(one["t_catch_s"].iloc[-1]) - one["t_s"].to_numpy(np.float64))
    distance_mm = 1e3 * np.linalg.norm(points - points[-1], axis=1)
    with drawing("predict-estimate", "Convergence of one estimate", width_in=3.4, height_in=2.6) as made:
        axes = made.axes()[0]
        axes.plot(left_ms, distance_mm, "o-", color=BALL, ms=3, lw=1.2, label="from the last")
        if np.isfinite(sigma).any() and sigma.any():
            axes.plot(left_ms, 1e3 * sigma, color=OTHER, lw=1.2, ls=(0, (4, 2)), label="stated sigma")
            positive = np.concatenate([distance_mm[:-1], 1e3 * sigma[np.isfinite(sigma)]])
            positive = positive[positive > 0]
            if len(positive) and positive.max() > 30 * np.median(positive):
                axes.set_yscale("symlog", linthresh=max(0.1, float(np.median(positive))))
        axes.invert_xaxis()
        axes.set_ylim(bottom=0)
        axes.set_xlabel("time left to the catch [ms]")
        axes.set_ylabel("distance [mm]")
        legend_above(axes, columns=2)
    return Panel(f"One estimate, flight {flight}", made.svg)


def thumbnails(log: StageLog, stage: str) -> Panel | None:
    """A few frames of the first camera, evenly over the detections, with the circle where the ball was found.

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
    for row in picked:
        image = images.iloc[row]
        total += len(image["data"])
        if total <= _MOST_IMAGE_BYTES and (cell := _thumbnail(image, seen, near=bool(cells))):
            cells.append(cell)
    return Panel(f"Camera “{camera}”", f'<div class="thumbs">{"".join(cells)}</div>') if cells else None


def _thumbnail(image: pd.Series, seen: pd.DataFrame, *, near: bool) -> str:
    """One camera image with the trail and the circle; ``near`` cuts out the surroundings of the trail.

    Empty where the image cannot be decoded.
    """
    data = bytes(image["data"])
    decoded = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
    if decoded is None:
        return ""
    height, width = decoded.shape
    left, top, wide = _cut(seen, width, height) if near and len(seen) else (0.0, 0.0, float(width))
    marks, caption = "", f"{1e3 * image['t_s']:.0f} ms"
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
    """Left, top and width [px] of the part of the image around the trail, in the image's proportions."""
    u, v = seen["u_px"].to_numpy(np.float64), seen["v_px"].to_numpy(np.float64)
    wide = min(float(width), 1.5 * max(float(np.ptp(u)), float(np.ptp(v)) * width / height, width / 6))
    tall = wide * height / width
    left = float(np.clip((u.min() + u.max() - wide) / 2, 0, width - wide))
    return left, float(np.clip((v.min() + v.max() - tall) / 2, 0, height - tall)), wide
