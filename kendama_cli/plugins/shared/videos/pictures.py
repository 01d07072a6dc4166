"""Images with lines and text drawn in, and what a detector sees."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.vision.detection.interface import Sighting

GREEN, RED, WHITE, BLACK = (80, 200, 80), (60, 60, 230), (255, 255, 255), (0, 0, 0)


def check_picture(shown: Mapping[str, tuple[NDArray[np.uint8], Sighting | None]]) -> NDArray[np.uint8]:
    """Return per camera, side by side, the image with the ball's circle drawn in, or 'not seen'."""
    panels = []
    for name, (pixels, sighting) in shown.items():
        panel = pixels.copy()
        if sighting is None:
            write_text(panel, f"{name}: not seen", 0)
        else:
            centre, radius = np.round(sighting.centre_px * 16).astype(int), round(sighting.radius_px * 16)
            cv2.circle(panel, (int(centre[0]), int(centre[1])), radius, GREEN, 1, cv2.LINE_AA, shift=4)
            for arm in np.array([[4.0, 0.0], [0.0, 4.0]]):
                draw_line(panel, sighting.centre_px - arm, sighting.centre_px + arm, GREEN)
            sigma = float(np.sqrt(np.trace(sighting.covariance_px2) / 2))
            u, v = sighting.centre_px
            write_text(
                panel, f"{name}: ({u:.1f}, {v:.1f}) px, radius {sighting.radius_px:.1f}, sigma {sigma:.2f} px", 0
            )
        panels.append(panel)
    return side_by_side(panels)


def as_png(pixels: NDArray[np.uint8]) -> bytes:
    """Return a picture as the content of a file."""
    return cv2.imencode(".png", pixels)[1].tobytes()


def side_by_side(panels: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Return the panels in a row, the lower ones filled up in black."""
    height = max(panel.shape[0] for panel in panels)
    grown = [cv2.copyMakeBorder(panel, 0, height - panel.shape[0], 0, 0, cv2.BORDER_CONSTANT) for panel in panels]
    return np.hstack([np.asarray(panel, dtype=np.uint8) for panel in grown])


def write_text(image: NDArray[np.uint8], text: str, line: int) -> None:
    """Write ``text`` into the image, in its ``line`` from above."""
    position = (8, 20 + 20 * line)
    (width, height), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.5, 1)
    image[position[1] - height - 3 : position[1] + below + 3, 4 : width + 12] = BLACK
    cv2.putText(image, text, position, cv2.FONT_HERSHEY_SIMPLEX, 0.5, WHITE, 1, cv2.LINE_AA)


def draw_line(image: NDArray[np.uint8], a: NDArray[np.float64], b: NDArray[np.float64], colour: Sequence[int]) -> None:
    """Draw a line between two pixels."""
    cv2.line(image, pixel_of(a), pixel_of(b), colour, 1, cv2.LINE_AA)


def pixel_of(pixel: NDArray[np.float64]) -> tuple[int, int]:
    """Return the whole pixel nearest to ``pixel`` (2,)."""
    return round(float(pixel[0])), round(float(pixel[1]))
