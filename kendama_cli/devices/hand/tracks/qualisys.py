"""Rigid bodies from Qualisys Track Manager's TSV export of 6DOF data."""

from __future__ import annotations

import numpy as np

from kendama_cli.devices.flight.table import numbers, rows_of
from kendama_cli.devices.hand.tracks.body_track import BodyTrack
from kendama_cli.errors import InputError
from kendama_cli.motion.rotation import exponential
from kendama_cli.motion.rotation_matrix import log_of

REMEDY = "export it again from Qualisys Track Manager as TSV with 6D data"
WIDTH = 16
"""Columns a body: X Y Z Roll Pitch Yaw Residual Rot[0] ... Rot[8], its rotation matrix column by column."""
MM_PER_M = 1000.0


def read_qualisys_bodies(path: str, text: str) -> list[BodyTrack]:
    """A track per body; a body that was not seen has zeros throughout, or no residual."""
    rows = rows_of(text, "\t")
    facts = {cells[0]: list(cells[1:]) for _, cells in rows[:20]}
    try:
        count, rate_hz = int(facts["NO_OF_BODIES"][0]), float(facts["FREQUENCY"][0])
        names = [name.strip() for name in facts["BODY_NAMES"] if name.strip()]
    except (KeyError, IndexError, ValueError):
        raise InputError(path, "no NO_OF_BODIES, BODY_NAMES or FREQUENCY in its header", remedy=REMEDY) from None
    head = next((i for i, (_, cells) in enumerate(rows[:20]) if "Rot[0]" in " ".join(cells)), None)
    if head is None or len(names) != count or len(rows) <= head + 1:
        problem = f"no row of columns with Rot[0] to Rot[8], or {len(names)} names for {count} bodies"
        raise InputError(path, problem, remedy=REMEDY)
    cells = [cell.strip() for cell in rows[head][1]]
    first = next(i for i, cell in enumerate(cells) if cell.split()[-1:] == ["X"])
    timed = "Time" in cells[:first]
    data = rows[head + 1 :]
    tracks = []
    for body, name in enumerate(names):
        at = first + WIDTH * body
        table = numbers(path, data, range(at, at + WIDTH), [f"{name} column {i + 1}" for i in range(WIDTH)])
        matrix = table[:, 7:].reshape(-1, 3, 3).transpose(0, 2, 1)
        seen = np.isfinite(table).all(axis=1) & (np.abs(np.linalg.det(np.nan_to_num(matrix)) - 1) < 0.05)
        place_m = np.where(seen[:, None], table[:, :3] / MM_PER_M, np.nan)
        turned = np.array(
            [exponential(log_of(one)) if fine else np.full(4, np.nan) for one, fine in zip(matrix, seen, strict=True)]
        )
        t_s = numbers(path, data, [cells.index("Time")], ["Time"])[:, 0] if timed else np.arange(len(data)) / rate_hz
        tracks.append(BodyTrack(name, t_s, place_m, turned))
    return tracks
