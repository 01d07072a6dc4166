"""One square marker (ArUco or AprilTag) in an image: its corners, also where it is small and blurred."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array

DICTIONARIES = {
    "4x4_50": cv2.aruco.DICT_4X4_50,
    "5x5_100": cv2.aruco.DICT_5X5_100,
    "apriltag_16h5": cv2.aruco.DICT_APRILTAG_16h5,
    "apriltag_36h11": cv2.aruco.DICT_APRILTAG_36h11,
}

REGION_SIDES = 2.5
"""Searched around where the marker is expected: so many of its sides to every side."""
SMALL_PX = 80.0
"""Below this side an image is enlarged until the marker is larger: the decoder needs some pixels a cell."""
SHARPENED, SOFT_PX = 1.0, 1.5
"""An unsharp mask, its weight and width: with 3 px of motion blur it decodes 1.00 of markers of 16 px, 0.87 without."""

LIKE = 0.7
"""Correlation from which a blurred image shows the marker as it was last read, blurred along a line."""
BLURS, BLUR_ANGLES = (0.2, 0.4, 0.6), 6
"""The lines' lengths, in sides, and how many directions they have."""
BLURRED_SIDES = 0.05
"""Standard deviation of a blurred marker's corners, in sides."""
EDGE_SIDES = 0.3
"""So much about the marker is compared: its white edge, and a part of what is behind."""
MIDDLE_OF_SIDE = (0.15, 0.85)
"""Blur rounds the corners; sides are straight between."""
POINTS_A_SIDE = 24
PROFILE_STEP_PX = 0.25
TURNS = 2

Image = NDArray[Any]


@dataclass(frozen=True)
class SeenMarker:
    """The corners (4, 2) [px] from the marker's top left on, clockwise as it is printed, and their standard deviation
    [px] where the image tells more than their reprojection; ``side_px`` is their mean distance."""

    corners_px: Array
    sigma_px: float = 0.0

    @property
    def side_px(self) -> float:
        """Mean length of the sides."""
        return float(np.linalg.norm(np.roll(self.corners_px, -1, axis=0) - self.corners_px, axis=1).mean())

    @property
    def centre_px(self) -> Array:
        """Mean of the corners."""
        return np.asarray(self.corners_px.mean(axis=0))


def marker_count(dictionary: str) -> int:
    """Return the number of markers of ``dictionary``."""
    return len(cv2.aruco.getPredefinedDictionary(DICTIONARIES[dictionary]).bytesList)


def black_cells(dictionary: str, number: int) -> NDArray[np.bool_]:
    """Return the black cells (n, n) of the marker; the outermost are its border, and all black."""
    marker = cv2.aruco.getPredefinedDictionary(DICTIONARIES[dictionary])
    return np.asarray(cv2.aruco.generateImageMarker(marker, number, marker.markerSize + 2) == 0)


class MarkerDetector:
    """Looks for the marker ``number`` of ``dictionary``."""

    def __init__(self, dictionary: str, number: int) -> None:
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE  # sides tell more, see below
        parameters.minMarkerPerimeterRate = 0.02
        parameters.adaptiveThreshWinSizeMax = 43
        parameters.adaptiveThreshWinSizeStep = 8
        printed = cv2.aruco.getPredefinedDictionary(DICTIONARIES[dictionary])
        self._detector = cv2.aruco.ArucoDetector(printed, parameters)
        self._number, self._cells = number, printed.markerSize + 2
        self._read: tuple[Image, Array] | None = None

    def find(self, image: NDArray[np.uint8], expected: SeenMarker | None = None) -> SeenMarker | None:
        """Find the marker in ``image`` (grey or BGR): first near ``expected``, enlarged if small, then anywhere.

        Where it cannot be read it is sought near ``expected`` as it looked when it last was, but blurred.
        """
        grey: Image = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        if expected is not None:
            reach = REGION_SIDES * max(expected.side_px, 16.0)
            low = np.maximum(np.floor(expected.centre_px - reach), 0).astype(int)
            high = np.ceil(expected.centre_px + reach).astype(int) + 1
            part = np.ascontiguousarray(grey[low[1] : high[1], low[0] : high[0]])
            tries = ((2, 0.0), (4, SHARPENED)) if expected.side_px < SMALL_PX else ((1, 0.0), (2, SHARPENED))
            for enlarged, sharpened in tries if part.size else ():
                found = self._found(part, enlarged, sharpened)
                if found is not None:
                    return self._seen(grey, found + low)
        for enlarged, sharpened in ((1, 0.0), (2, SHARPENED)):
            found = self._found(grey, enlarged, sharpened)
            if found is not None:
                return self._seen(grey, found)
        return None if expected is None or self._read is None else _blurred(grey, expected, *self._read)

    def _seen(self, grey: Image, corners_px: Array) -> SeenMarker:
        """Return the marker that was read, and keep how it looks."""
        seen = SeenMarker(along_sides(grey, corners_px, self._cells))
        edge = EDGE_SIDES * seen.side_px
        low = np.maximum(np.floor(seen.corners_px.min(axis=0) - edge), 0).astype(int)
        high = np.ceil(seen.corners_px.max(axis=0) + edge).astype(int) + 1
        self._read = grey[low[1] : high[1], low[0] : high[0]].copy(), seen.corners_px - low
        return seen

    def _found(self, grey: Image, enlarged: int, sharpened: float) -> Array | None:
        """Find corners (4, 2) in the pixels of ``grey``, looked for ``enlarged`` times as large and sharpened."""
        seen = grey
        if enlarged > 1:
            seen = cv2.resize(grey, None, fx=enlarged, fy=enlarged, interpolation=cv2.INTER_CUBIC)
        if sharpened:
            soft = cv2.GaussianBlur(seen, (0, 0), SOFT_PX * enlarged)
            seen = cv2.addWeighted(seen, 1 + sharpened, soft, -sharpened, 0)
        answer: Any = self._detector.detectMarkers(seen)  # without a marker the numbers are None
        corners, numbers = answer[:2]
        if numbers is None:
            return None
        mine = [one for one, number in zip(corners, np.ravel(numbers), strict=True) if number == self._number]
        if not mine:
            return None
        largest = max(mine, key=lambda one: float(cv2.contourArea(one)))
        # pixel centres lie at whole numbers: enlarged, the first pixel's centre is at (k - 1) / 2
        return np.asarray((largest.reshape(4, 2) - (enlarged - 1) / 2) / enlarged, dtype=np.float64)


def _blurred(grey: Image, expected: SeenMarker, picture: Image, corners_px: Array) -> SeenMarker | None:
    """Find the ``picture``, blurred along a line, near ``expected``; ``corners_px`` (4, 2) are its marker's."""
    reach = REGION_SIDES * expected.side_px
    low = np.maximum(np.floor(expected.centre_px - reach), 0).astype(int)
    high = np.ceil(expected.centre_px + reach).astype(int) + 1
    around = grey[low[1] : high[1], low[0] : high[0]]
    if around.shape[0] < picture.shape[0] or around.shape[1] < picture.shape[1]:
        return None
    best, found = LIKE, None
    for length in BLURS:
        for angle in np.pi * np.arange(BLUR_ANGLES) / BLUR_ANGLES:
            blurred = cv2.filter2D(picture, -1, _line(length * expected.side_px, float(angle)))
            _, score, _, place = cv2.minMaxLoc(cv2.matchTemplate(around, blurred, cv2.TM_CCOEFF_NORMED))
            if score > best:
                best, found = score, place
    if found is None:
        return None
    return SeenMarker(corners_px + low + found, BLURRED_SIDES * expected.side_px)


def _line(length_px: float, angle_rad: float) -> NDArray[np.float64]:
    """Return the kernel of a motion of ``length_px``."""
    half = int(np.ceil(length_px / 2))
    kernel = np.zeros((2 * half + 1, 2 * half + 1))
    for at in np.linspace(-length_px / 2, length_px / 2, 8 * half):
        kernel[round(half + at * np.sin(angle_rad)), round(half + at * np.cos(angle_rad))] += 1
    return np.asarray(kernel / kernel.sum())


def along_sides(grey: Image, corners_px: Array, cells: int) -> Array:
    """Return the intersections (4, 2) of lines through the sides, each fitted to the edge of the black border.

    A corner that is blurred is rounded off, and a marker of 16 px looks smaller, so farther away, by 3 %; the middle
    of a blurred edge stays in its place. ``cells`` are the marker's cells a side, its border included.
    """
    for _ in range(TURNS):
        centre = corners_px.mean(axis=0)
        lines = []
        for first, second in zip(corners_px, np.roll(corners_px, -1, axis=0), strict=True):
            way = second - first
            normal = np.array([way[1], -way[0]]) / max(float(np.linalg.norm(way)), 1e-9)
            if (first - centre) @ normal < 0:
                normal = -normal
            reach = max(0.9 * float(np.linalg.norm(way)) / cells, 1.5)
            share = np.linspace(*MIDDLE_OF_SIDE, POINTS_A_SIDE)[:, None]
            edge = _edge(grey, first + share * way, normal, reach)
            slope, offset = np.polyfit(share[:, 0], edge, 1)
            lines.append((first + offset * normal, way + slope * normal))
        corners = []
        for (a, along), (b, across) in zip(np.roll(np.array(lines), 1, axis=0), lines, strict=True):
            crossing = np.linalg.lstsq(np.column_stack((along, -across)), b - a, rcond=None)[0]
            corners.append(a + crossing[0] * along)
        made = np.array(corners)
        if not np.isfinite(made).all() or np.abs(made - corners_px).max() > 3.0:
            return corners_px  # no such sides: what the detector says
        corners_px = made
    return corners_px


def _edge(grey: Image, points_px: Array, normal: Array, reach: float) -> Array:
    """Return the distances (n,) [px] along ``normal`` to the edge from black to white, within ``reach``."""
    steps = np.arange(-reach, reach + PROFILE_STEP_PX / 2, PROFILE_STEP_PX)
    places = (points_px[:, None, :] + steps[None, :, None] * normal).astype(np.float32)
    profile = cv2.remap(grey, places[..., 0], places[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    rise = np.maximum(np.diff(np.asarray(profile, dtype=np.float64), axis=1), 0.0)
    middle = (steps[1:] + steps[:-1]) / 2
    return np.asarray(rise @ middle / np.maximum(rise.sum(axis=1), 1e-9))
