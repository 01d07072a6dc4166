"""Least squares on a ballistic flight at constant cost per observation: an information filter."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.triangulation import MIN_DEPTH_M, RayConstraints
from kendama_cli.vision.prediction.free_flight import FreeFlight

UNKNOWNS = 6
MIN_FREEDOM = 8
"""Residuals count only with this many observations (scalar) beyond the six unknowns."""
KNOWN_POSITION_M, KNOWN_VELOCITY_M_S = 0.005, 0.05
"""Once the ball is known so well, so are the depths that weight its pixels and the air that slows it, and the sums may
begin. Ten times as much put cameras that expose one after another 6 to 76 mm off, where this leaves 0.05 to 0.3 mm."""
ROUGH_POSITION_M, ROUGH_VELOCITY_M_S = 1.0, 10.0
"""A state that is not even known so well says nothing of depths and air: two images of a poor detector give 1e4 m/s."""
MAX_EARLY_SIGHTS = 200


class BallState(NamedTuple):
    """The ball at one time: position and velocity (3,), and the covariance (3, 3) of the position."""

    position_m: Array
    velocity_m_s: Array
    covariance_m2: Array


class BallisticFit:
    """Position and velocity at the first observation, by weighted linear least squares.

    ``FreeFlight`` gives every later position and how it changes with the six unknowns x, exactly linear without
    quadratic drag and very nearly so with it; ``RayConstraints`` makes every pixel linear in the position: J x = y,
    whitened. Only the sum of A^T A with A = (J, y - J x0) is kept, 7x7: information, vector and square at once, about
    a fixed reference x0 near the solution so that nothing cancels.
    """

    def __init__(self, flight: FreeFlight) -> None:
        self.flight = flight
        self.count = 0
        self._start_s = 0.0
        self._early: list[tuple[float, RayConstraints]] | None = []
        self._sums = np.zeros((UNKNOWNS + 1, UNKNOWNS + 1))
        self._reference = np.zeros(UNKNOWNS)
        self._state: Array | None = None
        self._covariance = np.zeros((UNKNOWNS, UNKNOWNS))
        self._ratio = 1.0
        self._solved = 0

    @property
    def residual_ratio(self) -> float:
        """Chi-square of the residuals per degree of freedom."""
        self._solve()
        return self._ratio

    def add(self, t_s: float, sight: RayConstraints) -> None:
        """Take one measurement; order and rate are free."""
        if self.count == 0:
            self._start_s = t_s
        self.count += len(sight.right)
        if self._early is None:
            self._accumulate(t_s - self._start_s, sight, weighted=True)
        else:
            self._early.append((t_s - self._start_s, sight))
            if len(self._early) > MAX_EARLY_SIGHTS and self._state is None:  # they did not suffice
                self.count -= len(self._early.pop(0)[1].right)

    def state(self, t_s: float) -> tuple[Array, Array] | None:
        """Position and velocity (3,) at ``t_s``; None while they are not even roughly known."""
        if not self.within(ROUGH_POSITION_M, ROUGH_VELOCITY_M_S) or self._state is None:
            return None
        start, velocity = self._state[:3], self._state[3:]
        if t_s == self._start_s:
            return start, velocity
        return self.flight.moved(start, velocity, t_s - self._start_s)

    def ball_state(self, t_s: float) -> BallState | None:
        """Return the ball at ``t_s``, with its position's covariance, scaled up if the residuals are too large."""
        known = self.state(t_s)
        if known is None or self._state is None:
            return None
        ahead = self.flight.transition(self._state[3:], t_s - self._start_s).position_s
        p = self._covariance
        moved = p[:3, 3:] @ ahead.T
        covariance = p[:3, :3] + moved + moved.T + ahead @ p[3:, 3:] @ ahead.T
        return BallState(*known, covariance * max(1.0, self._ratio))

    def within(self, position_m: float, velocity_m_s: float) -> bool:
        """Return True if the first position and velocity are known to these standard deviations along every axis."""
        self._solve()
        sigma = np.sqrt(self._covariance.diagonal())
        return self._state is not None and bool((sigma[:3] < position_m).all() and (sigma[3:] < velocity_m_s).all())

    @property
    def reference_s(self) -> float:
        """The time of the first observation."""
        return self._start_s

    def _accumulate(self, s: float, sight: RayConstraints, *, weighted: bool) -> None:
        """Add one measurement to the sums, weighted with the inverse depth of the reference."""
        reference = self._reference
        position = self.flight.moved(reference[:3], reference[3:], s)[0]
        ahead = self.flight.transition(reference[3:], s).position_s
        scaled, right = sight.rows, sight.right
        if weighted:
            weight = 1.0 / max(float(sight.depth_row @ position) + sight.depth_right, MIN_DEPTH_M)
            scaled, right = weight * scaled, weight * right
        whole = np.empty((len(right), UNKNOWNS + 1))
        whole[:, :3], whole[:, 3:UNKNOWNS], whole[:, UNKNOWNS] = scaled, scaled @ ahead, right - scaled @ position
        self._sums += whole.T @ whole

    def _solve(self) -> None:
        if self._solved == self.count or self.count < UNKNOWNS:
            return
        self._solved = self.count
        if self._early is None:
            self._step()
            return
        for _ in range(1 if self.within(ROUGH_POSITION_M, ROUGH_VELOCITY_M_S) else 3):
            rough = self.within(ROUGH_POSITION_M, ROUGH_VELOCITY_M_S)
            self._reference = self._state if rough and self._state is not None else np.zeros(UNKNOWNS)
            self._sums = np.zeros_like(self._sums)
            for s, sight in self._early:
                self._accumulate(s, sight, weighted=rough)
            if not self._step():
                return
        if self.within(KNOWN_POSITION_M, KNOWN_VELOCITY_M_S) or len(self._early) >= MAX_EARLY_SIGHTS:
            self._early = None

    def _step(self) -> bool:
        """Solve with the sums as they stand; the state stays as it was where they do not determine it."""
        try:
            covariance = np.linalg.inv(self._sums[:UNKNOWNS, :UNKNOWNS])
        except np.linalg.LinAlgError:
            return False
        vector = self._sums[:UNKNOWNS, UNKNOWNS]
        step = covariance @ vector
        if not (math.isfinite(float(step.sum())) and float(covariance.diagonal().min()) > 0):
            return False
        self._state, self._covariance = self._reference + step, np.asarray(covariance, dtype=np.float64)
        freedom = self.count - UNKNOWNS
        if freedom >= MIN_FREEDOM:
            self._ratio = max(float(self._sums[UNKNOWNS, UNKNOWNS] - step @ vector), 0.0) / freedom
        return True
