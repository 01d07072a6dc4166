"""From tracked positions of cup and ball to the state that the policy acts on."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.artifacts.checks import Array
from kendama_cli.blocks.robot.interface import RobotState
from kendama_cli.learning.state import SwingState


class SwingWatch:
    """Follows cup and ball by parabolas through the last ``samples`` readings of each, ``period_s`` apart.

    The value and slope at the newest reading are linear in the readings (least squares), without lag as long as the
    acceleration is constant. ``middle_m`` (3,) is the world position where the cup's x is zero, ``direction`` (3,) the
    unit vector of x; the ball's angle is that of the line from tie point to ball, unwrapped from reading to reading.
    """

    def __init__(self, period_s: float, samples: int, middle_m: Array, direction: Array) -> None:
        if samples < 3:
            raise ValueError(f"a parabola needs at least 3 samples, not {samples}")
        self._middle_m = np.asarray(middle_m, dtype=np.float64)
        self._direction = np.asarray(direction, dtype=np.float64)
        self._period_s = period_s
        self._samples = samples
        self._gains = {n: _gains(n, period_s) for n in range(2, samples + 1)}
        self._x: list[float] = []
        self._angle: list[float] = []

    def begin(self) -> None:
        """Forget everything: the next reading begins a new rollout."""
        self._x.clear()
        self._angle.clear()

    def see(self, state: RobotState) -> SwingState:
        """The swing's state after one more reading."""
        rope_m = state.ball_in_world_m - state.cup_in_world_m
        angle = math.atan2(float(self._direction @ rope_m), -float(rope_m[2]))
        if self._angle:
            angle += 2.0 * math.pi * round((self._angle[-1] - angle) / (2.0 * math.pi))
        x = float(self._direction @ (state.cup_in_world_m - self._middle_m))
        for history, reading in ((self._x, x), (self._angle, angle)):
            history.append(reading)
            del history[: -self._samples]
        if len(self._x) < 2:
            return SwingState(x, 0.0, angle, 0.0)
        value, slope = self._gains[len(self._x)]
        wrapped = math.remainder(_dot(value, self._angle), 2.0 * math.pi)
        return SwingState(_dot(value, self._x), _dot(slope, self._x), wrapped, _dot(slope, self._angle))


def _gains(n: int, period_s: float) -> tuple[list[float], list[float]]:
    """Weights of n readings for value and slope at the newest of the least-squares parabola (a line for n < 4)."""
    t = (np.arange(n) - (n - 1)) * period_s
    degree = 2 if n >= 4 else 1
    solve = np.linalg.pinv(np.vander(t, degree + 1, increasing=True))
    return solve[0].tolist(), solve[1].tolist()


def _dot(a: list[float], b: list[float]) -> float:
    return math.fsum(x * y for x, y in zip(a, b, strict=True))
