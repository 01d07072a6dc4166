"""The table that ``camera track`` writes: a row per frame with the ball."""

from __future__ import annotations

import csv
import io

import numpy as np

from kendama_cli.plugins.films.ball_film import FilmTrack
from kendama_cli.plugins.films.film_positions import FilmPositions

METRES = ("x_m", "y_m", "z_m", "sigma_x_m", "sigma_y_m", "sigma_z_m")
PIXELS = ("frame", "u_px", "v_px", "sigma_px", "radius_px", "score")


def track_table(first: FilmTrack, positions: FilmPositions | None) -> bytes:
    """Return the CSV: times of the first film [s], metres if they are known, then the first film's pixels."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("t_s", *(() if positions is None else METRES), *PIXELS))
    for i, t_s in enumerate(first.t_s):
        metres: list[str] = []
        if positions is not None:
            at = int(np.searchsorted(positions.t_s, t_s))
            if at == len(positions.t_s) or positions.t_s[at] != t_s:
                continue
            sigma = np.sqrt(np.diagonal(positions.covariance_m2[at]))
            metres = [f"{value:.6f}" for value in (*positions.position_m[at], *sigma)]
        sigma_px = np.sqrt(np.trace(first.covariance_px2[i]) / 2)
        cells = (f"{value:.3f}" for value in (*first.centre_px[i], sigma_px, first.radius_px[i], first.score[i]))
        rows.writerow((f"{t_s:.6f}", *metres, int(first.frame[i]), *cells))
    return text.getvalue().encode()
