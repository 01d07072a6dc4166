"""Finding the ball in an image: colour, outline, circle; 'not seen' instead of a guess."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.checks import Array
from kendama_cli.settings.predict import DetectorSettings

DIRECTIONS = 48
STEP_PX = 0.5
CUTOFFS_PX = (1.5, 1.0, 0.6, 0.4, 0.4)
"""Outline points farther than this from the circle are left out, pass by pass; noise and blur stay within 0.3 px."""
MIN_CONTRAST = 12.0
"""Grey levels between ball and surroundings along one direction; below, that direction shows no outline."""


@dataclass(frozen=True)
class Sighting:
    """The ball's disc in one image: centre (2,) and its covariance (2, 2) [px], radius [px], outline seen (0..1)."""

    centre_px: Array
    covariance_px2: Array
    radius_px: float
    outline: float


class BallDetector:
    """Largest patch of the ball's colour, then a circle through the sub-pixel outline of it.

    The outline is sought on rays from the patch's centre: where the image, projected on the line in colour space from
    surroundings to ball, falls through half of that ray's own contrast, so that shading does not shift it. Rays that
    end at the image's border, on an occluder or off the circle are left out, and the covariance
    sigma^2 (J^T J)^-1 of the circle's fit grows with every ray that is missing.
    """

    def __init__(self, settings: DetectorSettings) -> None:
        self._settings = settings
        angle = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        self._directions = np.column_stack([np.cos(angle), np.sin(angle)])

    def find(self, pixels: NDArray[np.uint8], origin_px: tuple[int, int] = (0, 0)) -> Sighting | None:
        """The ball in ``pixels`` (h, w, 3) blue, green, red, whose corner stands at ``origin_px``; None if not seen."""
        patch = self._patch(pixels)
        if patch is None:
            return None
        coarse = self._circle(pixels, *patch)
        if coarse is None:
            return None
        found = self._circle(pixels, coarse.centre_px, coarse.radius_px)  # its rays meet the outline at right angles
        if found is None:
            return None
        return Sighting(found.centre_px + np.array(origin_px), found.covariance_px2, found.radius_px, found.outline)

    def _patch(self, pixels: NDArray[np.uint8]) -> tuple[Array, float] | None:
        s = self._settings
        hsv = cv2.cvtColor(pixels, cv2.COLOR_BGR2HSV)
        if s.hue_low <= s.hue_high:
            mask = cv2.inRange(hsv, (s.hue_low, s.saturation_min, s.value_min), (s.hue_high, 255, 255))
        else:
            mask = cv2.inRange(hsv, (s.hue_low, s.saturation_min, s.value_min), (179, 255, 255))
            low = cv2.inRange(hsv, (0, s.saturation_min, s.value_min), (s.hue_high, 255, 255))
            mask = cv2.bitwise_or(mask, low)
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        if not contours:
            return None
        largest = max(contours, key=cv2.contourArea)
        (u, v), radius = cv2.minEnclosingCircle(largest)
        return (np.array([u, v]), float(radius)) if radius >= s.min_radius_px else None

    def _circle(self, pixels: NDArray[np.uint8], centre: Array, radius: float) -> Sighting | None:
        height, width = pixels.shape[:2]
        inner, outer = 0.5 * radius, 1.35 * radius + 3.0
        steps = np.arange(inner, outer + STEP_PX, STEP_PX)
        points = centre + self._directions[:, None, :] * steps[:, None]
        inside = ((points >= 0) & (points <= (width - 1, height - 1))).all(axis=2)
        columns, rows = points[..., 0].astype(np.float32), points[..., 1].astype(np.float32)
        profile = np.asarray(cv2.remap(pixels, columns, rows, cv2.INTER_LINEAR), dtype=np.float64)
        core, rim = int(0.2 * radius / STEP_PX) + 1, int(3.0 / STEP_PX)
        usable = inside[:, -1]
        if usable.sum() < self._settings.min_outline * DIRECTIONS:
            return None
        ball, around = profile[usable, :core].mean(axis=(0, 1)), profile[usable, -rim:].mean(axis=(0, 1))
        contrast = ball - around
        length = float(np.linalg.norm(contrast))
        if length < MIN_CONTRAST:
            return None
        signal = profile @ (contrast / length)
        low, high = signal[:, -rim:].mean(axis=1), signal[:, :core].mean(axis=1)
        usable &= high - low > MIN_CONTRAST
        level = (signal - (low + (high - low) / 2)[:, None]) / np.maximum(high - low, 1e-9)[:, None]
        crossing = (level[:, :-1] > 0) & (level[:, 1:] <= 0)
        usable &= crossing.any(axis=1)
        first = np.argmax(crossing, axis=1)
        before, after = level[np.arange(DIRECTIONS), first], level[np.arange(DIRECTIONS), first + 1]
        reach = steps[first] + STEP_PX * before / np.where(before > after, before - after, 1.0)
        return self._fit(centre, reach, usable)

    def _fit(self, centre: Array, reach: Array, usable: NDArray[np.bool_]) -> Sighting | None:
        """The circle through outline points at distance ``reach`` (n,) from ``centre``, outliers left out."""
        outline = centre + self._directions * reach[:, None]
        kept = usable.copy()
        if kept.sum() < 5:
            return None
        # what hides the ball makes rays shorter, never longer; half a disc still has the whole disc's outer circle
        middle, radius = centre, float(np.quantile(reach[kept], 0.7))
        for cutoff in CUTOFFS_PX:
            apart = outline - middle
            distance = np.maximum(np.linalg.norm(apart, axis=1), 1e-9)
            jacobian = np.column_stack([apart / distance[:, None], np.ones(len(apart))])
            residual = distance - radius
            kept = usable & (np.abs(residual) < cutoff)
            if kept.sum() < max(5, self._settings.min_outline * DIRECTIONS):
                return None
            normal = jacobian[kept].T @ jacobian[kept]
            step = np.linalg.solve(normal, jacobian[kept].T @ residual[kept])
            middle, radius = middle + step[:2], radius + float(step[2])
        left = residual[kept] - jacobian[kept] @ step
        variance = float(left @ left) / max(int(kept.sum()) - 3, 1)
        covariance = np.linalg.inv(normal)[:2, :2] * variance + np.eye(2) * self._settings.sigma_floor_px**2
        if radius < self._settings.min_radius_px:
            return None
        return Sighting(middle, np.asarray(covariance, dtype=np.float64), radius, float(kept.mean()))
