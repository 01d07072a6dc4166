"""Aim of a motion: which motion to play after each rollout, from where its ball came down beside the cup.

A model predicts the miss of a motion well enough to say how a change of the motion changes the miss, though not
where the ball comes down. So the residual between observed and predicted miss is learned, and the next motion is the
one whose predicted miss is minus the residual. (Related: Ploeger and Peters 2026, arXiv 2606.16978, a Newton step on
the task error with a fixed Jacobian.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array

Miss = tuple[float, float]
"""Distance of the ball from the cup's axis along x, the swing's direction, and y [m] at the rim's plane."""

RANGE_M = 0.25
"""Motions are simulated whose predicted miss along x is up to this, short and long."""
STEP_M = 0.04
"""Distance between their predicted misses."""
JUMP_M = 0.12
"""A simulated miss that changes by more in one step is another flight: the path of motions ends before it."""
PROBE = 0.3
"""Change of a parameter, in first standard deviations, by which its effect on the miss is simulated."""
ON_PATH_M = 0.12
"""A motion whose goal would have to move by more than this in flight is exchanged for another of the path."""
NEAR_M = 0.15
"""Residuals of rollouts that missed by more are not averaged: the motion was far from the one that catches."""
POOR_M, POOR_RATIO = 0.06, 0.5
"""A step is poor that leaves more than this ratio of a miss above POOR_M."""
MAX_POOR = 4
"""After so many poor steps in a row aiming has failed."""
SECANT_SLOPES = (0.3, 3.0)
"""Bounds of the observed slope of the miss over the predicted one."""

SHORT_M, LOW_M = 0.35, 0.08
"""A ball that never rose over the rim counts as SHORT_M short, and by what it lacked to LOW_M over the rim besides."""


@dataclass(frozen=True)
class AimPath:
    """Motions by their predicted miss along x: ``miss_m`` (n,) rising, their ``parameters`` (n, d), the first played.

    ``gain`` is the change of the miss along x and y for a goal that is moved by 1 m along the same axis in flight. The
    ball flies along x where ``forward`` is 1, against it where it is -1.
    """

    miss_m: tuple[float, ...]
    parameters: tuple[tuple[float, ...], ...]
    first_m: float
    gain: Miss
    forward: float = 1.0

    def parameters_at(self, miss_m: float) -> Array:
        """Return the parameters (d,) of the motion with this predicted miss, the path's end where it is beyond."""
        columns = np.array(self.parameters).T
        return np.array([np.interp(miss_m, self.miss_m, column) for column in columns])

    def clipped(self, miss_m: float) -> float:
        """Return ``miss_m`` or the end of the path that is nearest to it."""
        return float(np.clip(miss_m, self.miss_m[0], self.miss_m[-1]))


@dataclass(frozen=True)
class Aim:
    """Motion of predicted miss ``along_m`` on the path, with its goal moved in flight by ``shift_m`` (x, y).

    ``bent`` (d,) is what a search adds to the parameters of that motion where aiming has failed; empty for an aim.
    """

    along_m: float
    shift_m: Miss = (0.0, 0.0)
    bent: tuple[float, ...] = ()


@dataclass(frozen=True)
class AimedRollout:
    """Rollout of ``aim``: whether the ball was ``caught``, and where it came down."""

    aim: Aim
    caught: bool
    miss_m: Miss


def observed_miss(miss_m: Miss | None, apex_m: float, forward: float = 1.0) -> Miss:
    """Return ``miss_m``; without a descent that of a ball that rose to ``apex_m`` over the rim and fell short.

    ``forward`` is 1 for a ball that should have flown along x, -1 against it.
    """
    return (-forward * (SHORT_M + max(0.0, LOW_M - apex_m)), 0.0) if miss_m is None else miss_m


def path_of_motions(
    simulate: Callable[[Array], float | None], dimension: int
) -> tuple[list[float], list[Array], float]:
    """Return predicted misses (n,) [m], rising, the parameters (n, d) of their motions, and the miss of the first.

    From the motion of parameters zero on, in both directions, each step changes the predicted miss by STEP_M with the
    smallest change of the parameters: with the gradient g of the miss m,

        theta <- theta +- STEP_M g / (g . g).

    ``simulate`` returns the predicted miss of parameters (d,), None for a motion that cannot be played.
    """
    first = np.zeros(dimension)
    first_m = simulate(first)
    if first_m is None:
        raise ValueError("the motion of parameters zero cannot be played")
    rows = [(first_m, first)]
    rows += _one_way(simulate, first, first_m, 1.0)
    rows += _one_way(simulate, first, first_m, -1.0)
    rows.sort(key=lambda row: row[0])
    return [miss_m for miss_m, _ in rows], [parameters for _, parameters in rows], first_m


def _one_way(
    simulate: Callable[[Array], float | None], parameters: Array, miss_m: float, way: float
) -> Iterator[tuple[float, Array]]:
    """Yield predicted miss and parameters of one motion after the other towards RANGE_M in the direction ``way``."""
    while way * miss_m < RANGE_M:
        probes = [simulate(parameters + PROBE * unit) for unit in np.eye(len(parameters))]
        gradient = np.array([0.0 if probe is None else (probe - miss_m) / PROBE for probe in probes])
        if not gradient.any():
            return
        parameters = parameters + way * STEP_M * gradient / (gradient @ gradient)
        before_m, after_m = miss_m, simulate(parameters)
        if after_m is None or not 0.0 < way * (after_m - before_m) < JUMP_M:
            return
        miss_m = after_m
        yield miss_m, parameters


def next_aim(path: AimPath, rollouts: Sequence[AimedRollout], mouth_m: float) -> Aim | None:
    """Return the aim of the next rollout after ``rollouts``; None where aiming has failed and a search is needed.

    A miss below ``mouth_m`` counts as a catch: from the first on, the residuals are averaged, as the scatter from
    rollout to rollout is then larger than what remains to be learned. After MAX_POOR / 2 poor steps in a row the slope
    of the miss is taken from the last two rollouts instead of the model.
    """
    if not rollouts:
        return Aim(path.first_m)
    last, poor = rollouts[-1], _poor_steps(rollouts)
    if poor >= MAX_POOR:
        return None
    if poor == MAX_POOR // 2:
        return _secant(path, rollouts[-2], last)
    residuals = np.array([residual(path, one) for one in rollouts])
    missed_m = np.array([np.hypot(*one.miss_m) for one in rollouts])
    if (missed_m < mouth_m).any() or any(one.caught for one in rollouts):
        x, y = residuals[missed_m < NEAR_M].mean(axis=0) if (missed_m < NEAR_M).any() else residuals[-1]
        return aimed(path, path.clipped(-x), (-x, -y))
    x, y = residuals[-1]
    far = abs(-x - last.aim.along_m) > ON_PATH_M
    return aimed(path, path.clipped(-x) if far else last.aim.along_m, (-x, -y))


def predicted(path: AimPath, aim: Aim) -> Miss:
    """Return the miss that the model predicts for ``aim``."""
    (x, y), (gain_x, gain_y) = aim.shift_m, path.gain
    return aim.along_m + gain_x * x, gain_y * y


def residual(path: AimPath, rollout: AimedRollout) -> Miss:
    """Return the observed miss of ``rollout`` less the predicted one."""
    (x, y), (predicted_x, predicted_y) = rollout.miss_m, predicted(path, rollout.aim)
    return x - predicted_x, y - predicted_y


def aimed(path: AimPath, along_m: float, predicted_m: Miss) -> Aim:
    """Return the aim with this predicted miss whose motion is that at ``along_m``; the goal's shift does the rest."""
    (x, y), (gain_x, gain_y) = predicted_m, path.gain
    return Aim(along_m, ((x - along_m) / gain_x, y / gain_y))


def _poor_steps(rollouts: Sequence[AimedRollout]) -> int:
    """Return the number of poor steps in a row up to the newest rollout."""
    missed = [float(np.hypot(*one.miss_m)) for one in rollouts]
    count = 0
    for before, after in zip(missed[-2::-1], missed[:0:-1], strict=True):
        if before <= POOR_M or after <= POOR_RATIO * before:
            break
        count += 1
    return count


def _secant(path: AimPath, before: AimedRollout, last: AimedRollout) -> Aim:
    """Return the aim at which the straight line through the last two misses along x is zero."""
    (aim0, _), (aim1, aim1_y) = predicted(path, before.aim), predicted(path, last.aim)
    moved = aim1 - aim0
    slope = (last.miss_m[0] - before.miss_m[0]) / moved if moved else 1.0
    x = aim1 - last.miss_m[0] / float(np.clip(slope, *SECANT_SLOPES))
    return aimed(path, path.clipped(x), (x, aim1_y - last.miss_m[1]))
