"""Flights of a ball and the cameras' times adjusted together: readouts and clock offsets from what the ball must do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.constants
from numpy.typing import NDArray
from scipy.optimize import least_squares

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.free_flight import NODES, WEIGHTS

STATE = 6
TILT_SIGMA_RAD, SCALE_SIGMA = 0.1, 0.01
"""How well the world of a calibration is known to be level, and to have the size that it says."""
DRAG_PER_M, DRAG_SIGMA_PER_M = 0.015, 0.02
"""Of the ball, with the square of the speed: a kendama's has 0.007, a juggling ball 0.01, a tennis ball 0.02."""
CENTRE_SIGMA_PX, FOCAL_SIGMA = 0.5, 0.001
"""What a calibration leaves uncertain of a lens: its middle (and so where the camera points), its focal length."""
READOUT_SIGMA_S, OFFSET_SIGMA_S, FIXED_SIGMA_S = 0.1, 1.0, 1e-9
SIZE_SIGMA = 0.08
"""Blur and light make a ball look larger or smaller by such a part, in all images alike."""
OUTLIER_SIGMAS = 4.5
ROUNDS, STEPS = 3, 30


class Sights(NamedTuple):
    """Sightings (n,) in flights: the numbers of camera and flight, the frame's time [s]; the ball's centre (n, 2), the
    row of its disc, the disc's radius, and the standard deviations of centre and radius [px]."""

    camera: NDArray[np.intp]
    flight: NDArray[np.intp]
    frame_s: Array
    centre_px: Array
    row_px: Array
    radius_px: Array
    sigma_px: Array
    radius_sigma_px: Array


@dataclass(frozen=True)
class Adjusted:
    """Readouts (c,) [s], their standard deviations (c,) and degrees of freedom; offsets (c,) [s], the first 0."""

    readout_s: Array
    offset_s: Array
    sigma_s: Array
    freedom: int


class FlightBundle:
    """Least squares over places and velocities of flights, gravity, drag, readouts, offsets and small errors of lenses.

    What camera c shows in row v of h rows in the frame of time t is where the flight has the ball at
    t + (v - (h - 1) / 2) readout_c / h - offset_c. With ``radius_m`` the disc's size counts too; a readout stretches it
    by v' readout / h, its mean radius by half of that.
    """

    def __init__(
        self,
        cameras: Sequence[CameraModel],
        down: Array,
        reference_s: Array,
        *,
        same_clock: bool,
        radius_m: float | None,
    ) -> None:
        """``down`` (3,) is about where things fall; flights are described at the times ``reference_s`` (f,)."""
        self._cameras, self._reference_s, self._radius_m = cameras, reference_s, radius_m
        c, self._own = len(cameras), STATE * len(reference_s)
        self._drag, self._size = self._own + 3, self._own + 4
        self._readouts, self._offsets, self._lenses = (self._own + 5 + k * c for k in range(3))
        level = np.where(np.abs(down) > 0.5, SCALE_SIGMA, TILT_SIGMA_RAD)
        offsets = np.full(c, FIXED_SIGMA_S if same_clock else OFFSET_SIGMA_S)
        offsets[0] = FIXED_SIGMA_S
        self._expected = np.concatenate([scipy.constants.g * down, [DRAG_PER_M, 0.0], np.zeros(5 * c)])
        lens = np.tile([CENTRE_SIGMA_PX, CENTRE_SIGMA_PX, FOCAL_SIGMA], c)
        air = [DRAG_SIGMA_PER_M, SIZE_SIGMA]
        self._spread = np.concatenate([scipy.constants.g * level, air, np.full(c, READOUT_SIGMA_S), offsets, lens])

    def adjusted(self, sights: Sights, states: Array, readout_s: Array, offset_s: Array) -> Adjusted:
        """From ``states`` (f, 6) of the flights; what stays far off is left out, and noise is as large as it is.

        Raises ValueError where too few sightings are left.
        """
        c = len(self._cameras)
        self._expected[self._offsets - self._own :][:c] = offset_s
        values = np.concatenate([states.ravel(), self._expected])
        values[self._readouts : self._offsets] = readout_s
        slopes = np.empty((0, 0))
        for _ in range(ROUNDS):
            if 2 * len(sights.row_px) <= self._own + c:
                raise ValueError("the ball's flights are seen in too few frames")
            best = least_squares(self._left, values, jac=self._slopes, args=(sights,), x_scale="jac", max_nfev=STEPS)
            values, slopes = best.x, np.asarray(best.jac)
            off = best.fun[: 2 * len(sights.row_px)].reshape(-1, 2)
            share = 1 - self._own / off.size
            noise = np.array([_spread(off[sights.camera == k]) for k in range(c)])[sights.camera] / np.sqrt(share)
            sights = sights._replace(sigma_px=sights.sigma_px * noise)
            kept = (np.abs(off) < OUTLIER_SIGMAS * noise[:, None]).all(axis=1)
            sights = Sights(*(one[kept] for one in sights))
        length = np.linalg.norm(slopes, axis=0)  # units differ by many powers of ten
        try:
            spread = np.sqrt(np.linalg.inv((slopes / length).T @ (slopes / length)).diagonal()) / length
        except np.linalg.LinAlgError:
            raise ValueError("one of the ball's flights is seen in too few frames") from None
        return Adjusted(
            values[self._readouts : self._offsets],
            values[self._offsets : self._lenses],
            spread[self._readouts : self._offsets],
            2 * len(sights.row_px) - self._own,
        )

    def _left(self, values: Array, sights: Sights) -> Array:
        return self._both(values, sights)[0]

    def _slopes(self, values: Array, sights: Sights) -> Array:
        return self._both(values, sights)[1]

    def _both(self, values: Array, sights: Sights) -> tuple[Array, Array]:
        """Residuals of unit variance, and their slopes: pixels, sizes, what was known before."""
        n, camera, flight = len(sights.row_px), sights.camera, sights.flight
        state, gravity, drag = (
            values[: self._own].reshape(-1, STATE)[flight],
            values[self._own :][:3],
            values[self._drag],
        )
        height = np.array([one.height_px for one in self._cameras])[camera]
        late = (sights.row_px - (height - 1) / 2) / height
        readout_s = values[self._readouts :][camera]
        at_s = sights.frame_s + late * readout_s - values[self._offsets :][camera]
        s = (at_s - self._reference_s[flight])[:, None]
        slowing = state[:, None, 3:] + (s * NODES)[:, :, None] * gravity
        slowing *= np.linalg.norm(slowing, axis=2, keepdims=True)
        slowed = s * s * np.einsum("k,nki->ni", WEIGHTS * (1 - NODES), slowing)
        place = state[:, :3] + s * state[:, 3:] + s * s / 2 * gravity - drag * slowed
        speed = state[:, 3:] + s * gravity - drag * s * np.einsum("k,nki->ni", WEIGHTS, slowing)

        seen, by_place = self._seen(place, camera)
        error = values[self._lenses :].reshape(-1, 3)[camera]
        from_middle = seen[:, :2] - np.array([one.center_px for one in self._cameras])[camera]
        seen[:, :2] += error[:, :2] + error[:, 2:] * from_middle
        moved = np.einsum("nmi,ni->nm", by_place, speed)
        each, slopes = np.arange(n), np.zeros((n, by_place.shape[1], len(values)))
        for k in range(3):
            slopes[each, :, STATE * flight + k] = by_place[:, :, k]
            slopes[each, :, STATE * flight + 3 + k] = s * by_place[:, :, k]
        slopes[:, :, self._own : self._drag] = (s * s / 2)[:, :, None] * by_place
        slopes[:, :, self._drag] = -np.einsum("nmi,ni->nm", by_place, slowed)
        slopes[each, :, self._readouts + camera] = moved * late[:, None]
        slopes[each, :, self._offsets + camera] = -moved
        for k in range(2):
            slopes[each, k, self._lenses + 3 * camera + k] = 1.0
            slopes[each, k, self._lenses + 3 * camera + 2] = from_middle[:, k]
        wanted, sigma = sights.centre_px, np.column_stack([sights.sigma_px, sights.sigma_px])
        if self._radius_m is not None:
            grown = moved[:, 1] / (2 * height)
            part = (1 + values[self._size]) * (1 + grown * readout_s)
            slopes[:, 2] *= part[:, None]
            slopes[:, 2, self._size] = seen[:, 2]
            slopes[each, 2, self._readouts + camera] += seen[:, 2] * grown
            seen[:, 2] *= part
            wanted, sigma = (
                np.column_stack([wanted, sights.radius_px]),
                np.column_stack([sigma, sights.radius_sigma_px]),
            )
        left, slopes = (seen - wanted) / sigma, slopes / sigma[:, :, None]
        known = np.hstack([np.zeros((len(self._spread), self._own)), np.diag(1 / self._spread)])
        return (
            np.concatenate(
                [left[:, :2].ravel(), left[:, 2:].ravel(), (values[self._own :] - self._expected) / self._spread]
            ),
            np.vstack([slopes[:, :2].reshape(-1, len(values)), slopes[:, 2:].reshape(-1, len(values)), known]),
        )

    def _seen(self, place_m: Array, camera: NDArray[np.intp]) -> tuple[Array, Array]:
        """Pixels (n, 2) and their slopes by the place (n, 2, 3); with the radius of the disc where it counts."""
        parts = 2 if self._radius_m is None else 3
        seen, slopes = np.empty((len(place_m), parts)), np.empty((len(place_m), parts, 3))
        for k, one in enumerate(self._cameras):
            mine = camera == k
            inside = one.in_camera(place_m[mine])
            seen[mine, :2] = one.optics.project(inside)
            slopes[mine, :2] = one.optics.place_slopes(inside) @ one.world_to_camera
            if self._radius_m is not None:
                size = np.array([one.optics.size_px(point, self._radius_m) for point in inside])
                seen[mine, 2] = size
                # in the inverse of the distance
                away = -size[:, None] / (inside**2).sum(axis=1, keepdims=True) * inside
                slopes[mine, 2] = away @ one.world_to_camera
        return seen, slopes


def _spread(off: Array) -> float:
    """The standard deviation of what is normal, but for a few."""
    return 1.4826 * float(np.median(np.abs(off))) if len(off) else 1.0
