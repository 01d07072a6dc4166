"""Whether a camera stood still while it filmed: how far the scene's still parts are from where they mostly were."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.interface import Image

WIDEST_PX = 640
"""Images are looked at with at most so many pixels to a side."""
TILES = 4
"""An image is cut into so many tiles to a side: a ball, an arm or a person moves in some of them only."""
CORNERS, CORNER_QUALITY, CORNERS_APART_PX = 12, 0.02, 5.0
"""Corners of a tile that are followed, how distinct each is beside the tile's best one, and their least distance."""
LEAST_EIGENVALUE = 2e-4
"""Of a corner (cv2.cornerMinEigenVal); noise of 3 of 255 has up to 3e-5."""
LEAST_TILES, LEAST_STRUCTURED = 4, 0.6
"""Tiles of an image that tell a shift, and part of the tiles that must have corners: before a bare wall what moves in
the scene cannot be told from the camera."""
BACK_PX = 1.0
"""A corner that is followed there and back ends no farther from where it began."""
STILL_PART = 0.25
"""Of the tiles: where so many stand still the camera does, and what else moves is in the scene."""
UNMOVED_PX = 0.5
"""What stands still is found again so near, in spite of noise."""
MOVED_PART = 0.05
"""Of the images: fewer are chance."""
STANDING_PX = 3.0
"""A camera on a table shakes by less, which detectors of motion take out; more is another view."""


@dataclass(frozen=True)
class CameraShift:
    """How far (n,) [px] the scene in each image is from where most images show it, not a number where that cannot be
    told."""

    shift_px: Array

    @property
    def largest_px(self) -> float:
        """The largest shift that is known; 0 where none is."""
        return float(np.nanmax(self.shift_px, initial=0.0)) if np.isfinite(self.shift_px).any() else 0.0

    @property
    def stood(self) -> bool:
        """Whether the camera stood still, as far as that can be told."""
        return self.moved_part <= MOVED_PART

    @property
    def moved_part(self) -> float:
        """Part of the images, of those that tell, in which the scene is off by more than STANDING_PX."""
        known = self.shift_px[np.isfinite(self.shift_px)]
        return float(np.mean(known > STANDING_PX)) if len(known) else 0.0

    def at(self, image_t_s: Array, t_s: Array) -> Array:
        """The shift (n,) [px] at times ``t_s`` (n,), between the images, which are of ``image_t_s``."""
        known = np.isfinite(self.shift_px)
        if not known.any():
            return np.zeros(len(t_s))
        return np.asarray(np.interp(t_s, image_t_s[known], self.shift_px[known]), dtype=np.float64)


def camera_shift(images: Sequence[Image]) -> CameraShift:
    """How a camera moved, from images (h, w, 3) of one size that are spread over its film.

    Corners are followed from each image to the next (Lucas and Kanade 1981, in a pyramid) and back again; a tile's
    shift is the median of its corners'. Where a quarter of the tiles stands still the camera does, else it moves as
    the median tile. Corners of the first image that are found again near to where that leads, or to where they were,
    take away what has summed up in it. An image is as far off as the quarter of its tiles that is the least so, each
    from its median place. A scene with few corners tells nothing.
    """
    if not images:
        return CameraShift(np.zeros(0))
    scale = min(1.0, WIDEST_PX / max(images[0].shape[:2]))
    first = before = _Corners(_grey(images[0], scale))
    enough = max(LEAST_TILES, STILL_PART * len(np.unique(first.tile)))
    if len(np.unique(first.tile)) < LEAST_STRUCTURED * TILES**2:
        return CameraShift(np.full(len(images), np.nan))
    place, shifts = np.zeros(2), [np.zeros((TILES**2, 2))]
    for image in images[1:]:
        corners = _Corners(_grey(image, scale))
        step = _step(before.shift_px(corners, np.zeros(2)), enough)
        predicted = place if step is None else place + step
        direct = (first.near_px(corners, guess) for guess in (np.zeros(2), predicted))
        agreed = next((one for one in direct if np.isfinite(one[:, 0]).sum() >= enough), None)
        if agreed is not None:
            shifts.append(agreed)
        elif step is not None:
            shifts.append(np.tile(predicted, (TILES**2, 1)))
        else:
            shifts.append(first.none())
            continue
        before, place = corners, np.nanmedian(shifts[-1], axis=0)
    return CameraShift(_off(np.array(shifts)) / scale)


def _step(shift: Array, enough: float) -> Array | None:
    """The camera's own (2,) among the shifts (tiles, 2); None where too few tell."""
    if (np.hypot(*shift.T) <= UNMOVED_PX).sum() >= enough:
        return np.zeros(2)
    return np.nanmedian(shift, axis=0) if np.isfinite(shift[:, 0]).sum() >= enough else None


def _off(shifts: Array) -> Array:
    """Distance (n,) of each image's least moved tiles from their median places, for shifts (n, tiles, 2)."""
    off = np.full(len(shifts), np.nan)
    told = np.isfinite(shifts[..., 0])
    shifts = shifts[:, told.any(axis=0)]
    told = told[:, told.any(axis=0)]
    if not told.size:
        return off
    away = np.hypot(*np.moveaxis(shifts - np.nanmedian(shifts, axis=0), -1, 0))
    for i in np.flatnonzero(told.sum(axis=1) >= LEAST_TILES):
        off[i] = np.quantile(away[i, told[i]], STILL_PART)
    return off


def _grey(image: Image, scale: float) -> Image:
    if scale < 1:
        image = np.asarray(cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    # noise has corners too; a copy, since the caller's image is not ours to blur
    return np.asarray(cv2.GaussianBlur(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), (0, 0), 1.0), dtype=np.uint8)


class _Corners:
    """An image's corners (n, 2) [px], with the tile (n,) of each."""

    def __init__(self, grey: Image) -> None:
        self._grey = grey
        height, width = grey.shape[0] // TILES, grey.shape[1] // TILES
        places: list[Array] = [np.zeros((0, 2))]
        tiles: list[NDArray[np.intp]] = [np.zeros(0, dtype=np.intp)]
        strength = np.asarray(cv2.cornerMinEigenVal(grey, 3))
        for number in range(TILES**2):
            top, left = number // TILES * height, number % TILES * width
            part = np.ascontiguousarray(grey[top : top + height, left : left + width])
            found = cv2.goodFeaturesToTrack(part, CORNERS, CORNER_QUALITY, CORNERS_APART_PX) if part.size else None
            if found is None:
                continue
            place = found.reshape(-1, 2) + np.array([left, top])
            column, row = place.astype(int).T
            place = place[strength[row, column] > LEAST_EIGENVALUE]
            places.append(place)
            tiles.append(np.full(len(place), number))
        self.place_px, self.tile = np.vstack(places), np.concatenate(tiles)

    @staticmethod
    def none() -> Array:
        """No tile's shift (tiles, 2) is known."""
        return np.full((TILES**2, 2), np.nan)

    def shift_px(self, later: _Corners, guess_px: Array) -> Array:
        """Shift (tiles, 2) of each tile from here to ``later``, not a number where too few corners are found again."""
        made, grey = self.none(), later._grey
        if len(self.place_px) == 0:
            return made
        start = self.place_px.astype(np.float32)
        ahead = (start + guess_px).astype(np.float32)
        use, window, levels = cv2.OPTFLOW_USE_INITIAL_FLOW, (21, 21), 4
        there, good, _ = cv2.calcOpticalFlowPyrLK(
            self._grey, grey, start, ahead.copy(), winSize=window, maxLevel=levels, flags=use
        )
        back, good_back, _ = cv2.calcOpticalFlowPyrLK(
            grey, self._grey, there, (there - guess_px).astype(np.float32), winSize=window, maxLevel=levels, flags=use
        )
        kept = (good.ravel() == 1) & (good_back.ravel() == 1) & (np.hypot(*(back - start).T) < BACK_PX)
        for number in np.unique(self.tile[kept]):
            own = kept & (self.tile == number)
            if own.sum() >= max(2, (self.tile == number).sum() // 2):
                made[number] = np.median((there - start)[own], axis=0)
        return made

    def near_px(self, later: _Corners, guess_px: Array) -> Array:
        """``shift_px``, only of tiles that are within STANDING_PX of the guess."""
        made = self.shift_px(later, guess_px)
        made[np.hypot(*(made - guess_px).T) > STANDING_PX] = np.nan
        return made
