"""Work of ``camera board`` and ``camera calibrate``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from kendama_cli.cli import render
from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.errors import InputError, UsageError
from kendama_cli.plugins.calibration.board import KINDS, Board, BoardSearch, BoardView
from kendama_cli.plugins.calibration.calibration import CalibratedCamera, calibrate
from kendama_cli.plugins.shared.videos.pictures import GREEN, RED, as_png, draw_line, pixel_of, side_by_side, write_text
from kendama_cli.plugins.shared.videos.printed import INCH_M, as_pdf, page_of
from kendama_cli.plugins.shared.videos.video import VideoFile, shown_otherwise
from kendama_cli.plugins.shared.videos.views import IMAGES, cameras_of, read_views
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.hints import nearest
from kendama_cli.schema.units import count_of

PRINT_DPI = 300
RULER_ROOM_M = 0.01
PDF_PIXELS = 80
"""Size of a drawn square, so that the 8 cells of a marker are right to a hundredth of it."""
USUAL_PX, POOR_PX = 0.3, 0.6
"""Rms distance of the corners: sharp views of a flat board, with 0.15 px of noise along each axis, leave 0.21 px."""
ENLARGED = 50
"""Residuals are drawn so many times longer than they are."""


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
    """Write the picture to print, as PNG or PDF."""
    refuse_output(output, "a board is a PDF or a PNG", ".pdf", ".png")
    if output.suffix.lower() == ".pdf":
        write_output(output, _as_pdf(board))
        render.text(f"{output}: print it unscaled, check the line with a ruler, and glue it on something flat")
        return
    write_output(output, as_png(board.picture(round(board.square_m / INCH_M * PRINT_DPI))))
    render.text(f"{output}: print it at {PRINT_DPI} dpi, glue it on something flat, and measure a square")


def _as_pdf(board: Board) -> bytes:
    """Return one page with the board in its true size, and a line below to check it by."""
    width_m, board_m = (board.columns + 1) * board.square_m, (board.rows + 1) * board.square_m
    page = page_of(board.picture(PDF_PIXELS), width_m, board_m, RULER_ROOM_M)
    (axes,) = page.axes
    long_m = min(0.1 * math.floor((width_m - 0.01) / 0.1) or 0.01 * math.floor((width_m - 0.01) / 0.01), 0.2)
    axes.plot([(width_m - long_m) / 2, (width_m + long_m) / 2], [RULER_ROOM_M / 2] * 2, "k|-", lw=0.5, ms=6)
    axes.text(width_m / 2, RULER_ROOM_M / 5, f"{1e3 * long_m:.0f} mm: print unscaled, measure", ha="center", size=6)
    return as_pdf(page)


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
    for line in filter(None, map(judged, made)):
        render.prose(f"{line}: remove the views that stand out in {picture}, and see that the board is flat and sharp")
    render.text(f"{output}, {picture}; use it with camera.calibration={output}")


def judged(one: CalibratedCamera) -> str | None:
    """Return a line about residuals that are larger than usual, None where they are not."""
    if one.rms_px <= USUAL_PX:
        return None
    how = "poor" if one.rms_px > POOR_PX else "more than usual"
    return f"{one.model.name}: {one.rms_px:.2f} px is {how}, below {USUAL_PX:g} is usual"


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


def calibration_document(board: Board, cameras: Sequence[CalibratedCamera]) -> dict[str, Any]:
    """Return the content of a calibration file: the cameras as settings, then how well they fit."""
    return {
        "cameras": [
            {
                "name": one.model.name,
                "width_px": one.model.width_px,
                "height_px": one.model.height_px,
                "focal_px": _plain(one.model.focal_px, 4),
                "center_px": _plain(one.model.center_px, 4),
                "lens": one.model.lens,
                "distortion": _plain(one.model.distortion, 7),
                "position_m": _plain(one.model.position_in_world_m, 6),
                "look_at_m": None,
                "rotation_wxyz": _plain(
                    Rotation.from_matrix(one.model.world_to_camera.T).as_quat(canonical=True, scalar_first=True), 9
                ),
            }
            for one in cameras
        ],
        "board": {
            "columns": board.columns,
            "rows": board.rows,
            "square_mm": board.square_m * 1e3,
            "marker_mm": board.marker_m * 1e3,
        },
        "reprojection": {
            one.model.name: {
                "rms_px": round(one.rms_px, 4),
                "focal_sigma_px": _plain(one.sigma_px[:2], 4),
                "center_sigma_px": _plain(one.sigma_px[2:], 4),
                "views_px": {
                    view.name: round(float(error), 4) for view, error in zip(one.views, one.errors_px, strict=True)
                },
            }
            for one in cameras
        },
    }


def _plain(values: Array, digits: int) -> list[float]:
    return [round(float(value), digits) for value in values]


def calibration_picture(
    cameras: Sequence[CalibratedCamera], backgrounds: Mapping[str, NDArray[np.uint8]]
) -> NDArray[np.uint8]:
    """Return per camera, side by side, the corners of all views and the residuals of the model, enlarged."""
    panels = []
    for camera in cameras:
        panel = (backgrounds[camera.model.name] * 0.4).astype(np.uint8)
        for view, residuals in zip(camera.views, camera.residuals_px, strict=True):
            for seen, left in zip(view.pixels, residuals, strict=True):
                draw_line(panel, seen, seen + ENLARGED * left, RED)
                cv2.circle(panel, pixel_of(seen), 2, GREEN, -1, cv2.LINE_AA)
        worst = int(np.argmax(camera.errors_px))
        write_text(
            panel, f"{camera.model.name}: rms {camera.rms_px:.3f} px in {count_of(len(camera.views), 'view')}", 0
        )
        write_text(panel, f"worst view {camera.views[worst].name}: {camera.errors_px[worst]:.3f} px", 1)
        write_text(panel, f"red: residuals x {ENLARGED}", 2)
        panels.append(panel)
    return side_by_side(panels)
