"""Results of a calibration: the file that cameras take, and a picture of the residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from kendama_cli.plugins.calibration.board import Board
from kendama_cli.plugins.calibration.calibration import CalibratedCamera
from kendama_cli.plugins.shared.videos.pictures import GREEN, RED, draw_line, pixel_of, side_by_side, write_text
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import count_of

ENLARGED = 50
"""Residuals are drawn so many times longer than they are."""


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
