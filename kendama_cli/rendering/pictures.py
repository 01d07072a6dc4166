"""Pictures of a calibration and of what a detector sees."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.vision.calibration import CalibratedCamera
from kendama_cli.vision.interface import Sighting

ENLARGED = 50
"""Residuals are drawn so many times longer than they are."""
GREEN, RED, WHITE, BLACK = (80, 200, 80), (60, 60, 230), (255, 255, 255), (0, 0, 0)


def calibration_picture(
    cameras: Sequence[CalibratedCamera], backgrounds: Mapping[str, NDArray[np.uint8]]
) -> NDArray[np.uint8]:
    """Per camera, side by side: where the corners of all views lay, and what the model leaves over, enlarged."""
    panels = []
    for camera in cameras:
        panel = (backgrounds[camera.model.name] * 0.4).astype(np.uint8)
        for view, residuals in zip(camera.views, camera.residuals_px, strict=True):
            for seen, left in zip(view.pixels, residuals, strict=True):
                _line(panel, seen, seen + ENLARGED * left, RED)
                cv2.circle(panel, _point(seen), 2, GREEN, -1, cv2.LINE_AA)
        worst = int(np.argmax(camera.errors_px))
        _write(panel, f"{camera.model.name}: rms {camera.rms_px:.3f} px in {len(camera.views)} views", 0)
        _write(panel, f"worst view {camera.views[worst].name}: {camera.errors_px[worst]:.3f} px", 1)
        _write(panel, f"red: residuals x {ENLARGED}", 2)
        panels.append(panel)
    return _beside(panels)


def check_picture(shown: Mapping[str, tuple[NDArray[np.uint8], Sighting | None]]) -> NDArray[np.uint8]:
    """Per camera, side by side: the image with the ball's circle drawn in, or 'not seen'."""
    panels = []
    for name, (pixels, sighting) in shown.items():
        panel = pixels.copy()
        if sighting is None:
            _write(panel, f"{name}: not seen", 0)
        else:
            centre, radius = np.round(sighting.centre_px * 16).astype(int), round(sighting.radius_px * 16)
            cv2.circle(panel, (int(centre[0]), int(centre[1])), radius, GREEN, 1, cv2.LINE_AA, shift=4)
            for arm in np.array([[4.0, 0.0], [0.0, 4.0]]):
                _line(panel, sighting.centre_px - arm, sighting.centre_px + arm, GREEN)
            sigma = float(np.sqrt(np.trace(sighting.covariance_px2) / 2))
            u, v = sighting.centre_px
            _write(panel, f"{name}: ({u:.1f}, {v:.1f}) px, radius {sighting.radius_px:.1f}, sigma {sigma:.2f} px", 0)
        panels.append(panel)
    return _beside(panels)


def as_png(pixels: NDArray[np.uint8]) -> bytes:
    """Return a picture as the content of a file."""
    return cv2.imencode(".png", pixels)[1].tobytes()


def _beside(panels: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    height = max(panel.shape[0] for panel in panels)
    grown = [cv2.copyMakeBorder(panel, 0, height - panel.shape[0], 0, 0, cv2.BORDER_CONSTANT) for panel in panels]
    return np.hstack([np.asarray(panel, dtype=np.uint8) for panel in grown])


def _write(image: NDArray[np.uint8], text: str, line: int) -> None:
    place = (8, 20 + 20 * line)
    (width, height), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.5, 1)
    image[place[1] - height - 3 : place[1] + below + 3, 4 : width + 12] = BLACK
    cv2.putText(image, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, WHITE, 1, cv2.LINE_AA)


def _line(image: NDArray[np.uint8], a: NDArray[np.float64], b: NDArray[np.float64], colour: Sequence[int]) -> None:
    cv2.line(image, _point(a), _point(b), colour, 1, cv2.LINE_AA)


def _point(pixel: NDArray[np.float64]) -> tuple[int, int]:
    return round(float(pixel[0])), round(float(pixel[1]))
