"""Encoding of demonstrations as one primitive: align, encode, average, measure the loss, and find those that differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.dmp.basis import Basis
from kendama_cli.motion.dmp.encoding import Parameters, fit_demonstrations
from kendama_cli.motion.dmp.onset import MIN_SAMPLES, Moving, TrimmedDemonstration, common_margins, cut, moving_part
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.motion.dmp.settings import EncodeSettings
from kendama_cli.schema.arrays import Array

COORDINATES = ("x", "y", "z")


@dataclass(frozen=True)
class Deviation:
    """Distances between a primitive's motion and samples [m]: ``rms_m``, ``max_m``, over ``samples``."""

    rms_m: float
    max_m: float
    samples: int


@dataclass(frozen=True)
class Encoding:
    """The primitives of several demonstrations over one basis."""

    trimmed: tuple[TrimmedDemonstration, ...]
    parameters: Parameters
    basis: Basis
    coordinates: tuple[str, ...] = COORDINATES

    def __len__(self) -> int:
        return len(self.trimmed)

    def plan(self, i: int) -> MotionPlan:
        """Return the primitive of the i-th demonstration."""
        return self.average([i])

    def average(self, members: Sequence[int] | None = None) -> MotionPlan:
        """Return the primitive whose duration, goal, end rates and weights are the means over ``members`` (all by
        default).

        End velocities are averaged as rates (dy/ds = velocity x duration), as the weights are: so the average
        primitive's path is the average of the paths at equal fractions of their durations. ``variation`` keeps how the
        members differ.
        """
        chosen = list(range(len(self))) if members is None else list(members)
        p = self.parameters
        duration = float(p.duration_s[chosen].mean())
        start_rate, goal, goal_rate, weights = (
            values[chosen].mean(axis=0) for values in (p.start_rate, p.goal_m, p.goal_rate, p.weights)
        )
        return MotionPlan(
            coordinates=self.coordinates,
            duration_s=duration,
            tau_scale=1.0,
            stiffness=self.basis.stiffness,
            phase_decay=self.basis.decay,
            start_m=np.zeros(len(goal)),
            start_velocity_m_s=start_rate / duration,
            goal_m=goal,
            goal_velocity_m_s=goal_rate / duration,
            weights=weights,
            centers=self.basis.centers,
            widths=self.basis.widths,
            variation=_variation(p.vectors()[chosen]),
        )

    def deviation(self, plan: MotionPlan, i: int) -> Deviation:
        """Return the deviation of ``plan``, played at the i-th demonstration's duration, from its samples."""
        demonstration = self.trimmed[i]
        made = play(plan, demonstration.share * plan.duration_s * plan.tau_scale).position_m
        distance = np.linalg.norm(made - (demonstration.position_m - self.parameters.origin_m[i]), axis=1)
        return Deviation(
            rms_m=float(np.sqrt(np.mean(distance**2))),
            max_m=float(distance.max()),
            samples=len(distance),
        )


def prepare(demonstrations: Sequence[Demonstration], settings: EncodeSettings) -> tuple[TrimmedDemonstration, ...]:
    """Align the motions of all ``demonstrations``; raises ValueError that names the one that cannot be encoded."""
    trim = settings.trim == "rest"
    moving = [_moving(one, settings) for one in demonstrations]
    head, tail = (
        common_margins([one.t_s for one in demonstrations], moving, settings.margin_fraction) if trim else (None, None)
    )
    trimmed = []
    for one, part in zip(demonstrations, moving, strict=True):
        try:
            trimmed.append(cut(one.t_s, one.position_m, part, head, tail))
        except ValueError as error:
            raise ValueError(f"demonstration '{one.name}': {error}") from None
    return tuple(trimmed)


def encode(trimmed: Sequence[TrimmedDemonstration], settings: EncodeSettings) -> Encoding:
    """Return the demonstrations' primitives; goal, duration and weights are the paper's 22 parameters per
    coordinate.
    """
    parameters, basis = fit_demonstrations(trimmed, settings)
    return Encoding(tuple(trimmed), parameters, basis)


def encode_demonstrations(demonstrations: Sequence[Demonstration], settings: EncodeSettings) -> MotionPlan:
    """Return the average primitive of all ``demonstrations``, each relative to its own start and duration.

    Raises ValueError where a demonstration does not move or is too short.
    """
    return encode(prepare(demonstrations, settings), settings).average()


def _moving(demonstration: Demonstration, settings: EncodeSettings) -> Moving:
    name, t_s = demonstration.name, demonstration.t_s
    if len(t_s) < MIN_SAMPLES:
        raise ValueError(
            f"demonstration '{name}': a demonstration needs at least {MIN_SAMPLES} samples, not {len(t_s)}"
        )
    try:
        return moving_part(
            t_s, demonstration.position_m, rest_speed_m_s=settings.rest_speed_m_s, rest_fraction=settings.rest_fraction
        )
    except ValueError as error:
        raise ValueError(f"demonstration '{name}': {error}") from None


def _variation(vectors: Array) -> Array:
    """Return rows V with V^T V the covariance of ``vectors`` (N, p); none for one vector."""
    n = len(vectors)
    made: Array = (vectors - vectors.mean(axis=0)) / np.sqrt(max(n - 1, 1))
    return made if n > 1 else made[:0]


FEWEST = 4
"""Below so many demonstrations nobody can say which of them stands apart."""

APART = 3.5
"""Robust standard deviations from the others, times 1 + 4 / N: the median of a few distances is itself uncertain."""

LEAST_APART_M = 0.005
"""Demonstrations nearer than this to the others are never apart, however alike those are."""

LEAST_APART_SHARE = 0.1
"""The same for durations."""

ALIKE = 0.9
"""Paths agree where they correlate so well."""

BETTER = 4.0
"""Other axes must leave so many times less of a path unexplained."""


def apart(paths: Array, durations_s: Array) -> NDArray[np.bool_]:
    """Return a mask (N,) of the ``paths`` (N, n, c), at equal fractions, or of the durations (N,) that are outliers.

    Judged by the rms distance to the median path and by the logarithm of the duration against its median, each over
    1.4826 times the median of all N (the standard deviation of a normal distribution).
    """
    if len(paths) < FEWEST:
        return np.zeros(len(paths), dtype=bool)
    distance = np.sqrt(np.mean(np.sum((paths - np.median(paths, axis=0)) ** 2, axis=2), axis=1))
    length = np.log(durations_s)
    longer = np.abs(length - np.median(length))
    return _far(distance, LEAST_APART_M) | _far(longer, LEAST_APART_SHARE)


def _far(distance: Array, minimum: float) -> NDArray[np.bool_]:
    limit = max(minimum, APART * (1 + 4 / len(distance)) * 1.4826 * float(np.median(distance)))
    return np.asarray(distance > limit)


def axes_of(path: Array, others: Sequence[Array], names: Sequence[str]) -> str | None:
    """Return the axes, as text, by which ``path`` (n, c) agrees with ``others``; None if it agrees as it is or
    never can.

    Only where the others agree with each other.
    """
    if len(others) < FEWEST - 1:
        return None
    center = np.median(np.array(others), axis=0)
    if np.quantile([_alike(one, center) for one in others], 0.25) < ALIKE:
        return None
    as_it_is = _alike(path, center)
    if as_it_is > ALIKE:
        return None
    # an axis along which nobody moves has no order and no sign worth telling
    still = np.sqrt(np.mean(center**2, axis=0)) < 0.1 * np.sqrt(np.mean(center**2, axis=0)).max()
    best, found = max(ALIKE, 1 - (1 - as_it_is) / BETTER), None
    for order in permutations(range(path.shape[1])):
        for signs in product((1, -1), repeat=path.shape[1]):
            if any(still[i] and sign < 0 for i, sign in enumerate(signs)):
                continue
            similarity = _alike(path[:, order] * signs, center)
            if similarity > best:
                best = similarity
                found = ", ".join(
                    f"{names[i]} is its {'-' if signs[i] < 0 else ''}{names[order[i]]}"
                    for i in range(len(order))
                    if not still[i] and (order[i] != i or signs[i] < 0)
                )
    return found


def _alike(path: Array, other: Array) -> float:
    """Return the correlation of two paths (n, c), from -1 to 1."""
    a, b = path - path.mean(axis=0), other - other.mean(axis=0)
    return float(np.vdot(a, b) / max(np.sqrt(np.vdot(a, a) * np.vdot(b, b)), 1e-12))
