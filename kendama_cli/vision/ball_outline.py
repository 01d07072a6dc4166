"""The outline of a ball of any colours before a background that is known."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.circle_fit import CircleFit, Disc, outermost, through_contrast
from kendama_cli.vision.interface import Image, Sighting
from kendama_cli.vision.region import around, whole
from kendama_cli.vision.settings import MotionDetectorSettings
from kendama_cli.vision.sized_circle import sized_circle
from kendama_cli.vision.usual_size import size_likeness

OUTLINE, OUTLINE_SIGMA_PX = 0.5, 0.1
"""Part of the difference's outline that must fit one circle, and the least standard deviation that it gives."""
MOVED_PART, SIZED = 0.7, 1.6
"""A circle whose centre is farther from the disc's, in radii, or whose radius differs by more, is another thing's."""
MORE = 0.1
"""An outline that is painted over is told by so much more of it that fits the circle of the outermost edge."""
RIM = 0.3
"""Less than this part of the edges on the circle of known radius is no ball's rim."""
BESIDE_PX = 8.0
"""An outline is sought up to so far beside twice the radius."""
DARKEST = 0.05
"""Part of full scale below which a background is taken as so bright: there its numbers are mostly noise."""


class BallOutline:
    """The circle through where an image stops to differ from its background, in light."""

    def __init__(self, settings: MotionDetectorSettings) -> None:
        self._fit = CircleFit(
            min_radius_px=settings.min_radius_px, min_outline=OUTLINE, sigma_floor_px=OUTLINE_SIGMA_PX
        )
        self._gamma = settings.gamma
        self._light = (255 * np.linspace(0, 1, 256) ** settings.gamma).astype(np.float32)

    def circle(self, shown: Image, background: Image, least: float, disc: Disc) -> Sighting | None:
        """The circle about ``disc`` in ``shown`` (h, w, 3) before ``background``, None where the outline has none.

        That of a ball of one colour, or of any colours where that explains more of the outline or has more nearly the
        disc's size: the lit part of a ball may be round too. A difference below ``least`` grey levels is none.
        """
        more, corner = self._more_about(shown, background, disc)
        inside, best, best_fit = Disc(disc.centre - corner, disc.radius, disc.is_sized), None, -np.inf
        for outline in (through_contrast, outermost(least)):
            circle = self._fit.circle(more, inside, outline)
            if circle is not None and _is_of(circle, inside):
                fit = circle.score * size_likeness(circle.radius_px, disc.radius)
                if fit > best_fit + MORE:
                    best, best_fit = dataclasses.replace(circle, painted=outline is not through_contrast), fit
        return None if best is None else dataclasses.replace(best, centre_px=best.centre_px + corner)

    def painted_circle(self, shown: Image, background: Image, least: float, disc: Disc) -> Sighting | None:
        """That of a ball of several colours whose radius is known to a per cent; see ``sized_circle``."""
        more, corner = self._more_about(shown, background, disc)
        circle = sized_circle(more, Disc(disc.centre - corner, disc.radius, is_sized=True), least)
        if circle is None or circle.score < RIM or not _is_of(circle, Disc(disc.centre - corner, disc.radius)):
            return None
        return dataclasses.replace(circle, centre_px=circle.centre_px + corner)

    def _more_about(self, shown: Image, background: Image, disc: Disc) -> tuple[NDArray[np.float32], Array]:
        """The difference in light about a disc (h, w, 3), which may be empty, and its corner (2,) in the image."""
        height, width = shown.shape[:2]
        box = around(disc.centre, 2 * disc.radius + BESIDE_PX).within(whole(width, height))
        corner = np.array([box.left, box.top])
        if box.empty:
            return np.zeros((0, 0, 3), dtype=np.float32), corner
        part = slice(box.top, box.bottom), slice(box.left, box.right)
        return self._more_light(shown[part], background[part]), corner

    def _more_light(self, shown: Image, background: Image) -> NDArray[np.float32]:
        """How much more light there is than before (h, w, 3), in grey levels at the background's own brightness.

        A pixel that the ball covers by half has half of the difference in light, not in the numbers of an image: by
        those a dark ball before a bright wall looks 0.1 px smaller all round, and a white one larger.
        """
        level = max(float(background.mean()) / 255, DARKEST)
        more = cv2.subtract(cv2.LUT(shown, self._light), cv2.LUT(background, self._light))
        return np.asarray(more / np.float32(self._gamma * level ** (self._gamma - 1)), dtype=np.float32)


def _is_of(circle: Sighting, disc: Disc) -> bool:
    """Whether a circle is about the disc, and of its size."""
    moved = float(np.hypot(*(circle.centre_px - disc.centre)))
    sized = max(circle.radius_px / disc.radius, disc.radius / circle.radius_px)
    return moved < MOVED_PART * disc.radius and sized < SIZED
