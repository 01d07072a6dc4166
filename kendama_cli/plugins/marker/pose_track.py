"""Smooth motion from candidates per frame: the solution that fits over time, then a smoother over gaps.

Choosing is a shortest path (Viterbi) through the candidates: each costs its reprojection, each step the turn it asks
for. Smoothing is a Kalman filter of constant acceleration (white jerk) and Rauch, Tung and Striebel's pass back (AIAA
Journal 3, 1965); how lively the hand is, is chosen by likelihood.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from kendama_cli.plugins.marker.pose import PoseCandidate
from kendama_cli.schema.arrays import Array

CORNER_PX = 0.25
"""What corners are uncertain by at least; of blurred ones the reprojection tells more."""
TURN_RAD_S = 3.0
"""How fast a cup is turned, one standard deviation."""
TURN_RAD = 0.15
"""And how far two poses of one and the same marker differ by noise, one standard deviation."""
JERKS = (1e1, 1e2, 1e3, 1e4)
"""Spectral densities of a hand's jerk [m^2/s^5], of which the likeliest is taken."""
ALONG = (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
"""Along the view a swing moves less than across it, and is seen worse: the likeliest of these parts of the density."""
SPINS = (1e0, 1e1, 1e2, 1e3)
"""Of its angular acceleration [rad^2/s^3]."""
OUTLIER = 25.0
"""A frame whose squared innovation over its variance, a coordinate, is beyond this is not believed."""


@dataclass(frozen=True)
class _Seen:
    """Measurements at some of the instants: ``values`` (k, 3) with covariances ``noise`` (k, 3, 3)."""

    t_s: Array
    seen: NDArray[np.bool_]
    values: Array
    noise: Array


@dataclass(frozen=True)
class PoseTrack:
    """The smoothed marker at all frames (n,): places (n, 3) [m] and turns (n, 4) wxyz in the camera's frame.

    ``place_sigma_m`` (n, 3) are standard deviations; ``seen`` (n,) says where the marker was seen and believed;
    ``switched`` counts frames in which time overruled the lesser error.
    """

    place_m: Array
    rotation_wxyz: Array
    place_sigma_m: Array
    seen: NDArray[np.bool_]
    switched: int


def choose(t_s: Array, frames: Sequence[Sequence[PoseCandidate]]) -> list[int | None]:
    """Choose a candidate of each frame; None for a frame that has none."""
    known = [i for i, candidates in enumerate(frames) if candidates]
    if not known:
        return [None] * len(frames)
    cost = np.array([_unlikely(one) for one in frames[known[0]]])
    back: list[NDArray[np.intp]] = []
    for before, now in pairwise(known):
        spread = TURN_RAD**2 + (TURN_RAD_S * (t_s[now] - t_s[before])) ** 2
        step = np.array(
            [[_angle(a, b) ** 2 / (2 * spread) for a in frames[before]] for b in frames[now]], dtype=np.float64
        )
        total = cost[None, :] + step
        back.append(total.argmin(axis=1))
        cost = total.min(axis=1) + np.array([_unlikely(one) for one in frames[now]])
    chosen: list[int | None] = [None] * len(frames)
    best = int(cost.argmin())
    for at, ways in zip(reversed(known), [*reversed(back), None], strict=True):
        chosen[at] = best
        if ways is not None:
            best = int(ways[best])
    return chosen


def smooth(t_s: Array, frames: Sequence[Sequence[PoseCandidate]]) -> PoseTrack:
    """Return the motion at ``t_s`` (n,) through candidates of the frames (n,); raises ValueError if none has any."""
    chosen = choose(t_s, frames)
    seen = np.array([one is not None for one in chosen])
    if not seen.any():
        raise ValueError("the marker is seen in no frame")
    poses = [frames[i][one] for i, one in enumerate(chosen) if one is not None]
    noise = [max(CORNER_PX, one.error_px) ** 2 * one.covariance for one in poses]
    turns = Rotation.from_matrix(np.array([one.rotation for one in poses]))
    vectors = (turns * turns[0].inv()).as_rotvec()  # a cup that is held turns by less than half a circle
    places = _Seen(t_s, seen, np.array([one.place_m for one in poses]), np.array([one[:3, :3] for one in noise]))
    turned = _Seen(t_s, seen, vectors, np.array([one[3:, 3:] for one in noise]))
    place, place_sigma, believed = _likeliest(places, 3, JERKS, ALONG)
    turn, _, _ = _likeliest(turned, 2, SPINS, (1.0,))
    kept = seen.copy()
    kept[np.flatnonzero(seen)[~believed]] = False
    return PoseTrack(
        place,
        np.asarray((Rotation.from_rotvec(turn) * turns[0]).as_quat(scalar_first=True)),
        place_sigma,
        kept,
        sum(one not in (None, 0) for one in chosen),
    )


def _unlikely(one: PoseCandidate) -> float:
    return 4 * one.error_px**2 / (2 * CORNER_PX**2) / (1 + 4 * one.error_px**2)


def _angle(one: PoseCandidate, other: PoseCandidate) -> float:
    cosine = (np.trace(one.rotation.T @ other.rotation) - 1) / 2
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _likeliest(
    what: _Seen, order: int, densities: Sequence[float], along: Sequence[float]
) -> tuple[Array, Array, NDArray[np.bool_]]:
    across = max(densities, key=lambda one: _filter(what, order, np.full(3, one)).likelihood)
    runs = [_filter(what, order, across * np.array([1.0, 1.0, part])) for part in along]
    return max(runs, key=lambda run: run.likelihood).backward()


class _Run:
    """A filter's pass forward, kept for the pass back."""

    def __init__(self) -> None:
        self.likelihood = 0.0
        self.believed: list[bool] = []
        self.states: list[tuple[Array, Array, Array, Array, Array]] = []

    def backward(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return smoothed values (n, 3), their standard deviations (n, 3), and a mask of the measurements used."""
        _, _, mean, spread, _ = self.states[-1]
        made = [(mean[:3], np.sqrt(np.diag(spread)[:3]))]
        for (_, _, m, p, _), (m_ahead, p_ahead, _, _, step) in zip(
            reversed(self.states[:-1]), reversed(self.states[1:]), strict=True
        ):
            gain = np.linalg.solve(p_ahead, step @ p).T
            mean = m + gain @ (mean - m_ahead)
            spread = p + gain @ (spread - p_ahead) @ gain.T
            made.append((mean[:3], np.sqrt(np.maximum(np.diag(spread)[:3], 0.0))))
        made.reverse()
        return np.array([one for one, _ in made]), np.array([one for _, one in made]), np.array(self.believed)


def _filter(what: _Seen, order: int, density: Array) -> _Run:
    """Filter forward: ``order`` derivatives a coordinate, the highest a random walk of ``density`` (3,)."""
    run = _Run()
    size = 3 * order
    mean, spread = np.zeros(size), np.diag(np.repeat((1e2, 1e2, 1e3)[:order], 3))
    mean[:3] = what.values[0]
    row = 0
    for k in range(len(what.t_s)):
        step = np.eye(size)
        if k:
            step, drift = _model(float(what.t_s[k] - what.t_s[k - 1]), order, density)
            mean, spread = step @ mean, step @ spread @ step.T + drift
        m_ahead, p_ahead = mean, spread
        if what.seen[k]:
            surprise = what.values[row] - mean[:3]
            variance = spread[:3, :3] + what.noise[row]
            distance = float(surprise @ np.linalg.solve(variance, surprise))
            far = distance > 3 * OUTLIER
            run.believed.append(not far)
            run.likelihood -= 0.5 * (min(distance, 3 * OUTLIER) + float(np.linalg.slogdet(variance)[1]))
            if not far:
                gain = np.linalg.solve(variance, spread[:3]).T
                mean = mean + gain @ surprise
                spread = spread - gain @ variance @ gain.T
                spread = (spread + spread.T) / 2
            row += 1
        run.states.append((m_ahead, p_ahead, mean, spread, step))
    return run


def _model(dt_s: float, order: int, density: Array) -> tuple[Array, Array]:
    """Return the transition and process noise of white noise of ``density`` (3,) in the next derivative
    (Bar-Shalom)."""
    powers = np.array([[dt_s ** (j - i) for j in range(order)] for i in range(order)])
    factorial = np.array([1.0, 1.0, 2.0, 6.0])
    one = np.array([[powers[i, j] / factorial[j - i] if j >= i else 0.0 for j in range(order)] for i in range(order)])
    top = order - 1
    drift = np.array(
        [
            [
                dt_s ** (2 * top - i - j + 1) / (factorial[top - i] * factorial[top - j] * (2 * top - i - j + 1))
                for j in range(order)
            ]
            for i in range(order)
        ]
    )
    return np.kron(one, np.eye(3)), np.kron(drift, np.diag(density))
