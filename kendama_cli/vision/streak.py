"""The streak that a ball leaves while the shutter is open: both ends of the exposure from one image."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.interface import Image, Sighting, Streak
from kendama_cli.vision.region import around, whole
from kendama_cli.vision.streak_cover import MovingDisc, moments

FITTED_RADIUS_PX = 5.0
"""Larger balls are fitted in an image of fewer pixels: what is left of the ends is below a tenth of a pixel."""
DARKEST = 0.05
"""Part of full scale below which a number of the image is taken as so bright: there it is mostly noise."""
BESIDE_PX, BESIDE_RADII = 3.0, 0.6
"""So much of the surroundings is fitted too."""
ROUNDS, ENOUGH_PX, DAMPING = 12, 0.02, 1e-3
"""Steps at most; one that moves the ends by less is the last."""
OPTICS_PX, BLURS_PX = 1.5, (0.8, 8.0)
"""An edge is as soft as a box of so many pixels: usually, and at least and most."""
BLUR_SIGMA_PX = 0.4
SIZED_SIGMA, SIZE_SIGMA = 0.06, 0.4
"""Standard deviation of the given radius over itself, where it is known and where it is a guess."""
BEND_SIGMA = 0.05
"""Of the curvature, in 1/radii: a swing of 20 radii."""
UNEVEN = 1.6
"""A ball is painted where the residual on it is so many times the one about it."""
LEAST_PAINTED = 1.5
"""In radii: what moves less is not told from its paint."""
RIDGE = 0.002
"""Information about the polynomial beside the image's."""
OUTLIER_SIGMAS = 3.0
"""What is left beyond this is a string's or a hand's."""
SIGMA_FLOOR_PX = 0.05
MAD_SIGMA = 1.4826


class StreakGuess(NamedTuple):
    """A rough streak: its middle (2,), the way from one end to the other (2,) and the ball's radius [px]."""

    centre_px: Array
    way_px: Array
    radius_px: float
    is_sized: bool = False


class _Model(NamedTuple):
    """The degree of the polynomial that the ball's light is over its disc; how many residuals count for one beside what
    is known, and in the covariance (measured on rendered streaks)."""

    degree: int
    alike: float
    correlated: float


SHADED, PAINTED = _Model(2, 10.0, 4.0), _Model(3, 100.0, 16.0)
"""A ball of one colour has light and shade; one of several needs more, and leaves more, all of it alike."""


class _Task(NamedTuple):
    """All pixels of an image at (2, n), their noise's inverse (n,), background and difference over the noise (3, n)."""

    at: Array
    scale: Array
    background: Array
    difference: Array


class _Fit(NamedTuple):
    """Unknowns (7,) (centre, angle, length, radius, blur, bend), residuals (3, n), their slopes (7, 3, n), weights
    (n,), cover (n,), the unknowns' prior information (7,) and how many residuals count for one."""

    state: Array
    left: Array
    slopes: Array
    weight: Array
    cover: Array
    prior: Array
    correlated: float


def streak(shown: Image, background: Image, gamma: float, guess: StreakGuess) -> Sighting | None:
    """Fit a moving disc to ``shown`` (h, w, 3) before ``background`` (h, w, 3), both light^(1/gamma).

    A pixel that the ball covers for the part a of the exposure shows the light (1 - a) b + a c, with b the background's
    and c the ball's, a polynomial over its disc. Middle, direction, length, radius, blur and curvature by Gauss-Newton,
    the polynomial (linear in it) eliminated in every step (variable projection, Golub and Pereyra 1973); outliers
    lose their weight (Huber). The score is the part of the difference in light that is explained, but for the noise
    that is seen beside the streak. None where the fit leaves the image.
    """
    height, width = shown.shape[:2]
    radius = guess.radius_px
    half = np.abs(guess.way_px) / 2 + (1 + BESIDE_RADII) * radius + BESIDE_PX
    box = around(guess.centre_px, half).within(whole(width, height))
    if min(box.right - box.left, box.bottom - box.top) < 4:
        return None
    part, corner = (slice(box.top, box.bottom), slice(box.left, box.right)), np.array([box.left, box.top])
    fewer = max(round(radius / FITTED_RADIUS_PX), 1)
    task = _task(shown[part], background[part], gamma, fewer)
    start = StreakGuess(
        (guess.centre_px - corner + 0.5) / fewer - 0.5, guess.way_px / fewer, radius / fewer, guess.is_sized
    )
    usual = _begin(start, float(np.hypot(1.0, OPTICS_PX / fewer)))
    found = _fit(task, usual, usual, is_sized=guess.is_sized, model=SHADED)
    if found is not None and _is_painted(found):
        if found.state[3] < LEAST_PAINTED * found.state[4]:
            return None
        found = _fit(task, found.state, usual, is_sized=guess.is_sized, model=PAINTED)
    return None if found is None else _sighting(found, task, corner, fewer)


def _task(shown: Image, background: Image, gamma: float, fewer: int) -> _Task:
    """What is fitted, in an image of so many times ``fewer`` pixels along each side."""
    light = (np.linspace(0, 1, 256) ** gamma).astype(np.float32)
    images = [cv2.LUT(one, light) for one in (shown, background)]
    if fewer > 1:
        size = max(shown.shape[1] // fewer, 1), max(shown.shape[0] // fewer, 1)
        whole_ones = [one[: size[1] * fewer, : size[0] * fewer] for one in images]
        images = [np.asarray(cv2.resize(one, size, interpolation=cv2.INTER_AREA)) for one in whole_ones]
    height, width = images[0].shape[:2]
    level = np.maximum(np.maximum(images[0], images[1]).mean(axis=2), DARKEST**gamma)
    # even noise in the image's numbers is so much in light, but for a factor
    scale = (level ** -((gamma - 1) / gamma)).ravel().astype(np.float64)
    rows, columns = np.mgrid[:height, :width].astype(np.float64)
    now, before = (one.reshape(-1, 3).T * scale for one in images)
    return _Task(np.stack([columns.ravel(), rows.ravel()]), scale, before, now - before)


def _begin(guess: StreakGuess, blur: float) -> Array:
    u, v = guess.way_px
    angle, length = np.arctan2(v, u), max(float(np.hypot(u, v)), 1.0)
    return np.array([*guess.centre_px, angle, length, guess.radius_px, min(blur, guess.radius_px), 0.0])


def _fit(task: _Task, state: Array, usual: Array, *, is_sized: bool, model: _Model) -> _Fit | None:
    """Gauss-Newton from ``state``; what is ``usual`` is known beside the image. None where it leaves the image."""
    degree, alike, _ = model
    radius, last = float(usual[4]), task.at[:, -1]
    sigma = np.array([(SIZED_SIGMA if is_sized else SIZE_SIGMA) * radius, BLUR_SIGMA_PX, BEND_SIGMA / radius])
    prior = np.array([0.0, 0.0, 0.0, 0.0, *(1 / sigma**2)])
    weight = np.ones(task.at.shape[1])
    left, slopes, cover = _residual(state, task, weight, degree)
    for _ in range(ROUNDS):
        scatter = max(MAD_SIGMA * float(np.median(np.abs(left))), 1e-6)
        variance = scatter**2 * alike
        flat = (slopes * weight).reshape(len(state), -1)
        information = flat @ slopes.reshape(len(state), -1).T / variance
        slope = flat @ left.ravel() / variance + prior * (state - usual)
        damped = information + np.diag(prior + DAMPING * np.diag(information) + 1e-9)
        step = _kept_small(-np.asarray(np.linalg.solve(damped, slope), dtype=np.float64), state)
        state = _bounded(state + step, radius)
        if not (0 <= state[0] <= last[0] and 0 <= state[1] <= last[1]):
            return None
        off = np.sqrt((left * left).sum(axis=0) / 3) / scatter
        weight = OUTLIER_SIGMAS / np.maximum(off, OUTLIER_SIGMAS)
        left, slopes, cover = _residual(state, task, weight, degree)
        if max(np.abs(step[:2]).max(), abs(step[2]) * state[3] / 2, abs(step[3])) < ENOUGH_PX:
            break
    return _Fit(state, left, slopes, weight, cover, prior, model.correlated)


def _kept_small(step: Array, state: Array) -> Array:
    length, radius = state[3], state[4]
    most = np.array([radius, radius, 0.3, radius + 0.5 * length, 0.3 * radius, 1.0, 0.1 / radius])
    return np.clip(step, -most, most)


def _bounded(state: Array, radius: float) -> Array:
    low = [-np.inf, -np.inf, -np.inf, 0.3, 0.4 * radius, BLURS_PX[0], -0.3 / radius]
    high = [np.inf, np.inf, np.inf, np.inf, 2.5 * radius, BLURS_PX[1], 0.3 / radius]
    return np.clip(state, low, high)


def _is_painted(found: _Fit) -> bool:
    """Whether the ball leaves more than the wall about it does."""
    size = np.abs(found.left).mean(axis=0)
    on, beside = found.cover > 0.05, found.cover < 0.01
    if on.sum() < 10 or beside.sum() < 10:
        return False
    return float(np.median(size[on])) > UNEVEN * float(np.median(size[beside]))


def _explained(found: _Fit, difference: Array) -> float:
    """Part of the difference on the streak that the fit explains, the noise beside it left out."""
    left, total = ((one * one).sum(axis=0) for one in (found.left, difference))
    on, beside = found.cover > 0.05, found.cover < 0.01
    noise = float(np.median(left[beside])) * int(on.sum()) if beside.any() else 0.0
    whole_one = float(total[on].sum()) - noise
    return float(np.clip(1 - max(float(left[on].sum()) - noise, 0.0) / whole_one, 0.0, 1.0)) if whole_one > 0 else 0.0


def _sighting(found: _Fit, task: _Task, corner: Array, fewer: int) -> Sighting:
    """The result in the image's own pixels, with the covariance of middle and way."""
    state, left, weight = found.state, found.left, found.weight
    freedom = max(float(weight.sum()) * 3 - 24, 10.0)
    variance = max(float((left * left * weight).sum()) / freedom, 1e-12) * found.correlated
    flat = (found.slopes * weight).reshape(len(state), -1)
    information = flat @ found.slopes.reshape(len(state), -1).T / variance
    covariance = np.linalg.inv(information + np.diag(found.prior + 1e-9))
    angle, length = float(state[2]), float(state[3])
    along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    change = np.zeros((4, len(state)))
    change[0, 0] = change[1, 1] = 1.0
    change[2:, 2], change[2:, 3] = length * across, along
    both = fewer**2 * change @ covariance @ change.T + np.eye(4) * SIGMA_FLOOR_PX**2
    both = (both + both.T) / 2
    return Sighting(
        fewer * (state[:2] + 0.5) - 0.5 + corner,
        both[:2, :2],
        float(fewer * state[4]),
        _explained(found, task.difference),
        Streak(fewer * length * along, both),
    )


def _residual(state: Array, task: _Task, weight: Array, degree: int) -> tuple[Array, Array, NDArray[np.float64]]:
    """What the best colours leave (3, n) of the difference, its slopes (7, 3, n), those colours eliminated, and the
    cover (n,)."""
    u, v, angle, length, radius, blur, bend = (float(value) for value in state)
    along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    off = task.at - np.array([[u], [v]])
    x, s = along @ off, across @ off
    bow = x * x - length**2 / 12
    values, slopes = moments(x, s - bend * bow, MovingDisc(length, radius, blur), degree)
    b_x, b_y, b_length, b_radius, b_blur = slopes
    turn = 2 * bend * x
    changes = np.stack(
        [
            -along[0] * b_x + (turn * along[0] - across[0]) * b_y,
            -along[1] * b_x + (turn * along[1] - across[1]) * b_y,
            s * b_x - (x + turn * s) * b_y,
            b_length + (bend * length / 6) * b_y,
            b_radius,
            b_blur,
            -bow * b_y,
        ]
    )
    cover = values[0]
    shown = values * task.scale
    target = task.difference + cover * task.background
    weighed = shown * weight
    gram = weighed @ shown.T
    gram += np.eye(len(gram)) * max(gram[0, 0], 1e-9) * np.array([1e-9, *np.full(len(gram) - 1, RIDGE)])
    inverse = np.linalg.inv(gram)
    colours = inverse @ (weighed @ target.T)
    left = target - colours.T @ shown
    slope = changes[:, :1] * task.background - colours.T @ (changes * task.scale)
    # a change that other colours would undo shows nothing
    undone = slope @ weighed.T @ inverse
    return left, slope - undone @ shown, cover
