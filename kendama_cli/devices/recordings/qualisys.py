"""Rigid bodies (6D) and markers (3D) from Qualisys Track Manager's TSV export."""

from __future__ import annotations

import numpy as np

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.text_table import filled_rows, number, numbers
from kendama_cli.errors import InputError
from kendama_cli.motion.rotation import exponential, log_of
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import METRES

REMEDY = "export it again from Qualisys Track Manager as TSV with 3D or 6D data"
HEAD = 20
"""No head of its has more lines."""
WIDTH = 16
"""Columns a body: X Y Z Roll Pitch Yaw Residual Rot[0] ... Rot[8], its rotation matrix column by column."""


def read_qualisys(path: str, text: str) -> list[BodyTrack]:
    """Return a track per body of 6D data, else one per marker, named or not; raises InputError for another head."""
    rows = filled_rows(text, "tab")
    facts = {row.cells[0]: row.cells[1:] for row in rows[:HEAD]}
    kind = "BODIES" if "NO_OF_BODIES" in facts else "MARKERS"
    try:
        count, rate_hz = int(facts[f"NO_OF_{kind}"][0]), number(facts["FREQUENCY"][0]) or 0.0
    except (KeyError, IndexError, ValueError):
        raise InputError(path, f"no NO_OF_{kind} or FREQUENCY in its header", remedy=REMEDY) from None
    data = [row for row in rows if number(row.cells[0]) is not None]
    if not data or count < 1 or not rate_hz > 0:
        problem = f"{len(data)} data rows of {count} {kind.lower()} at {rate_hz:g} Hz"
        raise InputError(path, problem, remedy=REMEDY)
    head = next((row for row in rows[:HEAD] if "Frame" in row.cells or "Rot[0]" in " ".join(row.cells)), None)
    cells = [] if head is None else list(head.cells)
    before = next((i for i, cell in enumerate(cells) if cell.split()[-1:] == ["X"]), 0)
    timed = "Time" in cells[:before]
    t_s = numbers(path, data, [cells.index("Time")], ["Time"])[:, 0] if timed else np.arange(len(data)) / rate_hz
    width = 3 if kind == "MARKERS" else WIDTH
    labels = [*facts.get("MARKER_NAMES" if kind == "MARKERS" else "BODY_NAMES", ()), *[""] * count][:count]
    names = [label or f"{'marker' if kind == 'MARKERS' else 'body'} {i + 1}" for i, label in enumerate(labels)]
    columns = [f"{name} column {i + 1}" for name in names for i in range(width)]
    table = numbers(path, data, range(before, before + width * count), columns).reshape(len(data), count, width)
    if kind == "BODIES" and "Rot[0]" not in " ".join(cells):
        raise InputError(path, "no row of columns with Rot[0] to Rot[8]", remedy=REMEDY)
    tracked = _marker if kind == "MARKERS" else _body
    return [BodyTrack(name, t_s, *tracked(table[:, i])) for i, name in enumerate(names)]


def _marker(table: Array) -> tuple[Array, None]:
    """The places (n, 3); 0.000 on all axes means not seen."""
    return np.where((table == 0).all(axis=1, keepdims=True), np.nan, METRES["mm"] * table), None


def _body(table: Array) -> tuple[Array, Array]:
    """The places (n, 3) and rotations (n, 4); a body that was not seen has zeros throughout, or no residual."""
    matrix = table[:, 7:].reshape(-1, 3, 3).transpose(0, 2, 1)
    seen = np.isfinite(table).all(axis=1) & (np.abs(np.linalg.det(np.nan_to_num(matrix)) - 1) < 0.05)
    turned = [exponential(log_of(one)) if fine else np.full(4, np.nan) for one, fine in zip(matrix, seen, strict=True)]
    return np.where(seen[:, None], METRES["mm"] * table[:, :3], np.nan), np.array(turned)
