"""The figures of predict: what the camera saw, what was made of it, and how far off the predicted catch was."""

from __future__ import annotations

import numpy as np
import pandas as pd

from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import BALL, CUP, OTHER
from kendama_cli.report.thumbnails import thumbnails
from kendama_cli.stages.predict.messages import CatchEstimateMessage, PredictionErrorMessage


def prediction_figures(log: StageLog) -> list[Figure]:
    """Return the camera images with the detection; the error against the horizon; one estimate as it settles."""
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
                "Camera images of one flight with the detected ball (ring); the line joins all detections. The ring"
                " must sit on the ball. Times are from the last detection. The first image is whole, the others cut."
            ],
            [film],
            columns=1,
        ),
        *figure(
            lettered(
                study,
                [
                    f"Position error of the predicted catch over the time left until it, {n} flights: median, half of"
                    " all flights (dark) and 90 % of them (light). It must fall to the right.",
                    f"Time error of the predicted catch over the time left until it, {n} flights: median, half of all"
                    " flights (dark) and 90 % of them (light).",
                    "Distance of each estimate of one flight from its last one, and the standard deviation that it"
                    " states: points under the dashed line are as sure as they claim.",
                ],
            ),
            study,
            columns=3,
        ),
    ]


def like_horizons(horizon_ms: pd.Series) -> pd.Series:
    """Return horizons at which errors are combined: those that flights have in common, else of groups of about 15
    like ones.
    """
    horizon = horizon_ms.round(3)
    if 3 * horizon.nunique() < len(horizon):
        return horizon
    groups = int(np.clip(len(horizon) // 15, 4, 15))
    rank = (horizon.rank(method="first") - 1) * groups // len(horizon)
    return horizon.groupby(rank).transform("median")


def error_panel(errors: pd.DataFrame, column: str, title: str) -> Panel | None:
    """Return the quantile bands of |error| over the horizon."""
    if errors.empty:
        return None
    errors = errors[np.isfinite(errors[column].to_numpy(np.float64))]
    if errors.empty:
        return None
    spread = (
        errors[column]
        .abs()
        .groupby(like_horizons(errors["horizon_ms"]))
        .quantile(np.array([0.05, 0.25, 0.5, 0.75, 0.95]))
        .unstack()
    )
    at = spread.index.to_numpy(np.float64)
    unit = column.rsplit("_", 1)[1]
    with drawing(f"predict-{unit}", f"{title}: error against the horizon", width_in=3.4, height_in=2.6) as made:
        axes = made.axes()[0]
        axes.fill_between(at, spread[0.05], spread[0.95], color=CUP, alpha=0.15, lw=0, label="90 %")
        axes.fill_between(at, spread[0.25], spread[0.75], color=CUP, alpha=0.32, lw=0, label="50 %")
        axes.plot(at, spread[0.5], "o-", color=CUP, ms=3.2, lw=1.3, label="median")
        axes.invert_xaxis()
        axes.set_ylim(bottom=0)
        axes.set_xlabel("time to the catch [ms]")
        axes.set_ylabel(f"error [{unit}]")
        legend_above(axes)
    return made.panel(title)


def _convergence(estimates: pd.DataFrame) -> Panel | None:
    """Return the distance from the last estimate, and the stated sigma, over the time left, for the longest flight."""
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
            axes.plot(left_ms, 1e3 * sigma, color=OTHER, lw=1.2, ls=(0, (4, 2)), label="stated σ")
            positive = np.concatenate([distance_mm[:-1], 1e3 * sigma[np.isfinite(sigma)]])
            positive = positive[positive > 0]
            if len(positive) and positive.max() > 30 * np.median(positive):
                axes.set_yscale("symlog", linthresh=max(0.1, float(np.median(positive))))
                axes.yaxis.set_major_formatter("{x:g}")
        axes.invert_xaxis()
        axes.set_ylim(bottom=0)
        axes.set_xlabel("time to the catch [ms]")
        axes.set_ylabel("distance [mm]")
        legend_above(axes, columns=2)
    return made.panel(f"One estimate, flight {flight}")
