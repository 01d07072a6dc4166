"""Work of ``camera board`` and ``camera calibrate``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from kendama_cli.cli import render
from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.devices.camera.video import VideoFile, shown_otherwise
from kendama_cli.devices.camera.views import IMAGES, cameras_of, read_views
from kendama_cli.errors import InputError, UsageError
from kendama_cli.plugins.calibration.board import KINDS, Board, BoardSearch, BoardView
from kendama_cli.plugins.calibration.calibration import CalibratedCamera, calibrate
from kendama_cli.plugins.calibration.calibration_file import calibration_document, calibration_picture
from kendama_cli.rendering.pictures import as_png
from kendama_cli.schema.hints import nearest

PRINT_DPI = 300


@dataclass(frozen=True)
class CalibrationRequest:
    """Board, images by camera, and the board's place in the first of them."""

    board: Board
    kinds: tuple[str, ...]
    paths: tuple[Path, ...]
    board_at: str


def board_of(squares: str, square_mm: float, marker_mm: float) -> Board:
    """Return the board that the options describe; raises UsageError where there can be none."""
    columns, _, rows = squares.lower().partition("x")
    if not (columns.isdecimal() and rows.isdecimal() and 3 <= int(columns) <= 22 and 3 <= int(rows) <= 22):
        raise UsageError(f"--board {squares}: allowed are COLUMNSxROWS of 3 to 22 squares each, such as 7x5")
    if not 0 < marker_mm < square_mm:
        raise UsageError(f"--marker-mm {marker_mm:g}: a marker must lie within its square of {square_mm:g} mm")
    return Board(int(columns), int(rows), square_mm / 1e3, marker_mm / 1e3)


def kinds_of(kind: str) -> tuple[str, ...]:
    """Return the kinds of board that an option allows; raises UsageError for an unknown one."""
    if kind not in ("auto", *KINDS):
        raise UsageError(f"--board-kind {kind}: allowed are auto, {', '.join(KINDS)}{nearest(kind, KINDS)}")
    return KINDS if kind == "auto" else (kind,)


def draw_board(board: Board, output: Path) -> None:
    """Write the picture to print."""
    refuse_output(output, "a picture is a PNG", ".png")
    write_output(output, as_png(board.picture(round(board.square_m / 0.0254 * PRINT_DPI))))
    render.text(f"{output}: print it at {PRINT_DPI} dpi, glue it on something flat, and measure a square")


def calibrate_cameras(request: CalibrationRequest, output: Path, *, as_json: bool) -> None:
    """Calibrate, write the file and a picture beside it, and show how well it went.

    Raises UsageError or InputError, with nothing written, where the views cannot be used.
    """
    search, paths, centre_m = BoardSearch(request.board, request.kinds), request.paths, _triple(request.board_at)
    refuse_output(output, "a calibration is YAML", ".yaml", ".yml")
    sizes: dict[str, tuple[int, int]] = {}
    views: dict[str, list[BoardView]] = {}
    backgrounds: dict[str, NDArray[np.uint8]] = {}
    for name, sources in cameras_of(paths).items():
        views[name] = []
        for film in (VideoFile(source) for source in sources if source.suffix.lower() not in IMAGES):
            for line in shown_otherwise(film):
                render.note(line)
        for view, pixels in read_views(sources):
            sizes[name], backgrounds[name] = (pixels.shape[1], pixels.shape[0]), pixels
            found = search.find(pixels, view)
            if found is None:
                render.note(f"{name}, {view}: the board is not seen")
            else:
                views[name].append(found)
    if any(view.legacy for seen in views.values() for view in seen):
        render.note("the board has the pattern of OpenCV before 4.6, its first square white")
    board = search.board
    if search.recognised:
        render.note(f"seen: {board}")
    try:
        made = calibrate(board, views, sizes, centre_m)
    except ValueError as error:
        raise InputError(", ".join(map(str, paths)), str(error)) from None
    document = calibration_document(board, made)
    note = "# Made by 'kendama camera calibrate'; use it with camera.calibration=FILE\n"
    write_output(output, (note + yaml.safe_dump(document, sort_keys=False)).encode())
    picture = output.with_suffix(".png")
    write_output(picture, as_png(calibration_picture(made, backgrounds)))
    if as_json:
        render.document({"calibration": str(output), "picture": str(picture), **document})
        return
    render.table(
        [_row(one) for one in made],
        head=("camera", "views", "rms_px", "worst_px", "focal_px", "centre_px", "position_m"),
    )
    render.text(f"{output}, {picture}; use it with camera.calibration={output}")


def _row(one: CalibratedCamera) -> tuple[str, ...]:
    values = [*one.model.focal_px.tolist(), *one.model.center_px.tolist()]
    sure = [f"{value:.1f}+-{sigma:.1f}" for value, sigma in zip(values, one.sigma_px, strict=True)]
    place = " ".join(f"{x:.3f}" for x in one.model.position_in_world_m)
    fit = f"{one.rms_px:.3f}", f"{one.errors_px.max():.3f}"
    return one.model.name, str(len(one.views)), *fit, " ".join(sure[:2]), " ".join(sure[2:]), place


def _triple(text: str) -> NDArray[np.float64]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"--board-at {text}: give three numbers in metres, such as 0,0,-0.55") from None
    return np.array([x, y, z])
