"""What was foreseen in the games: for the film, and held against what came."""

from __future__ import annotations

import numpy as np
import pandas as pd

from kendama_cli.report.animation import Ahead
from kendama_cli.report.figure import Panel
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import CUP, MUTED, OTHER
from kendama_cli.report.tracks import Array, Track, direction

_BINS = 10
_FEWEST = 6
"""Tracked places of the ball from which its real crossing is told."""


def ahead(log: StageLog, game: int, cup: Track, start_s: float) -> list[Ahead]:
    """The estimates of ``game`` in the plane of the tracks; ``cup`` is its path there, times count from ``start_s``."""
    estimates = log.table("/transfer/estimate")
    tracked = log.table("/transfer/cup")
    if estimates.empty or tracked.empty:
        return []
    first = tracked[tracked["t_s"] >= start_s].iloc[0]
    balls = log.table("/transfer/ball")
    along = np.array(direction(balls[balls["t_s"].between(start_s, start_s + float(np.ptp(cup.t_s)))]))
    found = []
    for row in estimates[estimates["game"] == game].itertuples():
        place = along @ np.array([row.x_m - first["x_m"], row.y_m - first["y_m"]])
        speed = along @ np.array([row.velocity_x_m_s, row.velocity_y_m_s])
        covariance = np.array(row.covariance_m2).reshape(3, 3)[:2, :2]
        found.append(
            Ahead(
                t_s=row.t_s - start_s,
                crossing_s=row.t_catch_s - start_s,
                x_m=float(place + cup.x_m[0]),
                z_m=float(row.z_m - first["z_m"] + cup.z_m[0]),
                x_m_s=float(speed),
                z_m_s=float(row.velocity_z_m_s),
                sigma_m=float(np.sqrt(max(along @ covariance @ along, 0.0))),
            )
        )
    return found


def error_over_time_panel(log: StageLog) -> Panel | None:
    """Error and stated uncertainty of every estimate of the games over the time left to the crossing."""
    estimates = log.table("/transfer/estimate")
    if estimates.empty:
        return None
    rows = []
    for _, of_game in estimates.groupby("game"):
        crossing = _crossing(of_game, log.table("/transfer/ball"))
        if crossing is None:
            continue
        crossing_s, place_m = crossing
        error = np.linalg.norm(of_game[["x_m", "y_m"]].to_numpy(np.float64) - place_m, axis=1)
        covariance = np.array(of_game["covariance_m2"].tolist()).reshape(-1, 3, 3)
        sigma = np.sqrt(np.maximum(covariance[:, 0, 0] + covariance[:, 1, 1], 0.0))
        rows.append(
            np.column_stack([1e3 * (crossing_s - of_game["t_s"].to_numpy(np.float64)), 1e3 * error, 1e3 * sigma])
        )
    if not rows:
        return None
    left_ms, error_mm, sigma_mm = np.vstack(rows).T
    group = pd.cut(pd.Series(left_ms), _BINS)
    middle = (
        pd.DataFrame({"left": left_ms, "error": error_mm, "sigma": sigma_mm}).groupby(group, observed=True).median()
    )
    with drawing("transfer-foreseen", "Error over the time left to the catch", width_in=4.6, height_in=3.1) as made:
        axes = made.axes()[0]
        axes.plot(left_ms, error_mm, ".", color=MUTED, ms=2.5, alpha=0.6, label="estimate")
        axes.plot(middle["left"], middle["error"], "o-", color=CUP, ms=3.5, lw=1.4, label="median")
        axes.plot(middle["left"], middle["sigma"], color=OTHER, lw=1.2, ls=(0, (4, 2)), label="stated sigma")
        axes.set_yscale("log")
        axes.invert_xaxis()
        axes.set_xlabel("time left to the catch [ms]")
        axes.set_ylabel("error [mm]")
        legend_above(axes, columns=3)
    return Panel("Error of what was foreseen", made.svg)


def _crossing(estimates: pd.DataFrame, balls: pd.DataFrame) -> tuple[float, Array] | None:
    """When and where (2,) the tracked ball really came down through the height of the estimates.

    A parabola through its places from the first estimate on until just before: across they lie on lines.
    """
    last = estimates.iloc[-1]
    flight = (
        balls[balls["t_s"].between(estimates["t_s"].iloc[0] - 0.1, last["t_catch_s"] - 0.005)] if len(balls) else balls
    )
    if len(flight) < _FEWEST:
        return None
    s = flight["t_s"].to_numpy(np.float64) - last["t_catch_s"]
    x, y = (np.polyfit(s, flight[name].to_numpy(np.float64), 1) for name in ("x_m", "y_m"))
    z = np.polyfit(s, flight["z_m"].to_numpy(np.float64) - last["z_m"], 2)
    roots = np.roots(z)
    real = roots[np.abs(roots.imag) < 1e-9].real
    if not len(real):
        return None
    late = float(real.max())
    return float(last["t_catch_s"] + late), np.array([np.polyval(x, late), np.polyval(y, late)])
