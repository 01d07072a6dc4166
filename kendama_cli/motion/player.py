"""A movement primitive played step by step, with its time scale and its goal changed on the fly.

    tau_now = tau (1 + (miss / tolerance)^2)                                    (phase stopping)
    g' = beta (g_wanted - g) / tau_now,   beta = sqrt K / 2

Where the cup falls behind, everything slows down together, so that the path stays what it is (A. J. Ijspeert, J.
Nakanishi, H. Hoffmann, P. Pastor, S. Schaal, "Dynamical movement primitives", Neural Computation 25, 2013, section
2.2 slows the phase alone, which leaves the path). A changed goal is approached smoothly (there, section 2.1.5).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.dmp import forcing
from kendama_cli.motion.moving_goal import goal_path
from kendama_cli.schema.arrays import Array

STEP_SHARE = 1e-3
"""Longest Runge-Kutta step as a share of the motion: the error of the whole motion stays below a micrometre."""


@dataclass(frozen=True)
class DmpStep:
    """The motion at one instant; ``share`` is s (1: the end), arrays are (c,)."""

    share: float
    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array


class DmpPlayer:
    """Plays ``plan`` from its start; ``now`` is where it is.

    ``tolerance_m`` is the tracking error at which the motion goes on at half its speed. ``step_share`` is the longest
    step of the integration (classical Runge-Kutta, order 4) as a share of the motion.
    """

    def __init__(self, plan: MotionPlan, *, tolerance_m: float = 0.05, step_share: float = STEP_SHARE) -> None:
        self._plan = plan
        self._tolerance_m = tolerance_m
        self._step_share = step_share
        self._frequency = float(np.sqrt(plan.stiffness))
        self._goal_rate = plan.goal_velocity_m_s * plan.duration_s
        self._share = 0.0
        self._wanted = plan.goal_m
        # rows: y, dy/ds, g
        self._state: Array = np.array([plan.start_m, plan.start_velocity_m_s * plan.duration_s, plan.goal_m])
        self._tau_scale = plan.tau_scale
        self._tau_s = plan.tau_scale * plan.duration_s

    @property
    def now(self) -> DmpStep:
        """Where the motion is, with velocity and acceleration at its present pace."""
        slope = self._slope(self._share, self._state, past=self._share >= 1.0)
        return DmpStep(self._share, self._state[0].copy(), self._state[1] / self._tau_s, slope[1] / self._tau_s**2)

    def step(
        self,
        dt_s: float,
        *,
        tau_scale: float | None = None,
        goal_m: Array | None = None,
        measured_m: Array | None = None,
    ) -> DmpStep:
        """Go on by ``dt_s`` and return where the motion is then.

        ``tau_scale`` and ``goal_m`` (c,) hold from this step on; ``measured_m`` (c,), where given, is where the cup
        really is now, and slows this step down. Raises ValueError for a time or a scale that is not positive.
        """
        if tau_scale is not None and not 0 < tau_scale < np.inf:
            raise ValueError(f"tau_scale must be positive and finite, not {tau_scale!r}")
        if not 0 < dt_s < np.inf:
            raise ValueError(f"dt_s must be positive and finite, not {dt_s!r}")
        if goal_m is not None:
            self._wanted = np.array(goal_m, dtype=np.float64)
        if tau_scale is not None:
            self._tau_scale = tau_scale
        pace = self._tau_scale * self._plan.duration_s
        if measured_m is not None:
            miss = float(np.linalg.norm(np.asarray(measured_m) - self._state[0])) / self._tolerance_m
            pace *= 1.0 + miss**2
        self._tau_s = pace
        self._advance(dt_s / pace)
        return self.now

    def _advance(self, change: float) -> None:
        """Go on by ``change`` of the share, with a node at the end of the motion, where f ends."""
        end = self._share + change
        for stop in (1.0, end) if self._share < 1.0 < end else (end,):
            begin = self._share
            count = max(1, int(np.ceil((stop - begin) / self._step_share - 1e-9)))
            nodes = np.linspace(begin, stop, count + 1)
            for s, after in pairwise(nodes):
                self._state = self._runge_kutta(float(s), float(after - s), past=begin >= 1.0)
            self._share = stop

    def _runge_kutta(self, s: float, h: float, *, past: bool) -> Array:
        y = self._state
        k1 = self._slope(s, y, past=past)
        k2 = self._slope(s + h / 2, y + h / 2 * k1, past=past)
        k3 = self._slope(s + h / 2, y + h / 2 * k2, past=past)
        k4 = self._slope(s + h, y + h * k3, past=past)
        return np.asarray(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))

    def _slope(self, s: float, state: Array, *, past: bool) -> Array:
        """d state / ds; ``past`` the end there is no forcing."""
        position, rate, goal = state
        at = np.array([s])
        path = goal_path(at, goal, self._goal_rate)
        push = 0.0 if past else forcing(self._plan, at)[0]
        w = self._frequency
        goal_change = w / 2 * (self._wanted - goal)
        second = path.second[0] + 2 * w * (path.rate[0] - rate) + w**2 * (path.position[0] - position) + push
        return np.array([rate, second, goal_change])
