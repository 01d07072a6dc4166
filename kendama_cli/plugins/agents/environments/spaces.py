"""Observations of an agent as float32, in units or normalised, and its actions, checked."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from kendama_cli.errors import ConfigError
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState

Observation = NDArray[np.float32]
ActionKind = Literal["discrete", "continuous"]
LARGEST_RATE_RAD_S = 100.0
"""Readings of the ball's angular velocity are cut here; swings stay far below."""
USUAL_RATE_RAD_S = 10.0
"""The rate that counts as 1 in a normalised observation."""


@dataclass(frozen=True)
class Observed:
    """Numbers that are observed: the maximum of each, and what counts as 1 where they are normalised, both (n,)."""

    largest: NDArray[np.float64]
    scale: NDArray[np.float64]
    normalised: bool

    @classmethod
    def swing(cls, settings: LearnSettings, *, normalised: bool) -> Observed:
        """Return the cup's x [m] and velocity [m/s], ball angle [rad] and angular velocity [rad/s], time left [s]."""
        workspace, left_s = settings.workspace, settings.rollout_s
        position, speed = workspace.half_width_m, workspace.max_speed_m_s
        maximum = np.array([2.0 * position, 2.0 * speed, math.pi, LARGEST_RATE_RAD_S, left_s])
        return cls(maximum, np.array([position, speed, math.pi, USUAL_RATE_RAD_S, left_s]), normalised)

    @property
    def box(self) -> spaces.Space[Observation]:
        """The space of one observation."""
        highest = (self.largest / self.scale if self.normalised else self.largest).astype(np.float32)
        box: Any = spaces.Box(-highest, highest, dtype=np.float32)
        return cast("spaces.Space[Observation]", box)

    def reading(self, state: SwingState, left_s: float) -> Observation:
        """Return the observation of a reading of a swing and the time left [s]."""
        x_m, velocity_m_s, angle_rad, rate_rad_s = state
        return self.of(np.array([x_m, velocity_m_s, math.remainder(angle_rad, 2.0 * math.pi), rate_rad_s, left_s]))

    def of(self, numbers: NDArray[np.float64]) -> Observation:
        """Return the observation of ``numbers`` (..., n), cut at the maximum."""
        cut = np.clip(numbers, -self.largest, self.largest)
        return np.asarray(cut / self.scale if self.normalised else cut, dtype=np.float32)


class Accelerations:
    """Actions as accelerations of the cup along x [m/s^2]."""

    def __init__(self, settings: LearnSettings, kind: ActionKind) -> None:
        """Choose discrete actions (indices of ``learn.actions_m_s2``) or continuous ones (fractions of the maximum).

        Raises ConfigError for another ``kind``.
        """
        if kind not in ("discrete", "continuous"):
            raise ConfigError("actions", f"'actions' is {kind!r}; allowed: discrete, continuous")
        self._values = np.array(settings.actions_m_s2)
        self._largest = settings.max_action_m_s2
        self.space: spaces.Space[Any] = (
            spaces.Discrete(len(self._values)) if kind == "discrete" else spaces.Box(-1.0, 1.0, (1,), dtype=np.float32)
        )

    def one(self, action: Any) -> float:
        """Return the acceleration of one action; raises gymnasium's InvalidAction where it is none."""
        if isinstance(self.space, spaces.Discrete):
            if isinstance(action, (int, np.integer, np.ndarray)) and self.space.contains(action):
                return float(self._values[int(action)])
            raise gymnasium.error.InvalidAction(f"action {action!r}; allowed: whole numbers 0 to {self.space.n - 1}")
        try:
            fraction = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            fraction = np.empty(0)
        if fraction.shape != (1,) or not abs(float(fraction[0])) <= 1.0:
            raise gymnasium.error.InvalidAction(f"action {action!r}; allowed: an array of one number from -1 to 1")
        return float(fraction[0]) * self._largest

    def many(self, actions: Any, n: int) -> NDArray[np.float64]:
        """Return the accelerations (n,) of ``n`` actions; raises gymnasium's InvalidAction where one is none."""
        try:
            given = np.asarray(actions)
        except ValueError:  # rows of different lengths
            given = np.empty(0, dtype=object)
        if isinstance(self.space, spaces.Discrete):
            allowed = f"({n},) whole numbers 0 to {self.space.n - 1}"
            if given.shape != (n,) or not np.issubdtype(given.dtype, np.integer):
                raise _no_actions(given, allowed)
            _refuse_first(given, (given < 0) | (given >= self.space.n), allowed)
            return np.asarray(self._values[given])
        allowed = f"({n}, 1) numbers, -1 to 1"
        if given.shape != (n, 1) or not (
            np.issubdtype(given.dtype, np.floating) or np.issubdtype(given.dtype, np.integer)
        ):
            raise _no_actions(given, allowed)
        _refuse_first(given[:, 0], ~(np.abs(given[:, 0]) <= 1.0), allowed)
        return np.asarray(given[:, 0].astype(np.float64) * self._largest)


def _no_actions(given: NDArray[Any], allowed: str) -> Exception:
    return gymnasium.error.InvalidAction(f"actions of shape {given.shape} and type {given.dtype}; allowed: {allowed}")


def _refuse_first(given: NDArray[Any], wrong: NDArray[np.bool_], allowed: str) -> None:
    """Raise gymnasium's InvalidAction with the first of the actions (n,) that is ``wrong`` (n,), and its index."""
    if wrong.any():
        i = int(np.argmax(wrong))
        raise gymnasium.error.InvalidAction(f"action {given[i]} of environment {i}; allowed: {allowed}")
