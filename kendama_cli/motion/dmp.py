"""Playing a movement primitive (PAPER.md eq. 3-5).

    v' = (K (g - y) - D v + f(x)) / tau,   y' = v / tau,   x' = -alpha x / tau,   D = 2 sqrt K

tau = ``tau_scale`` x ``duration_s`` is the time that the motion takes. After tau the forcing term is zero and the
motion settles on its goal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.artifacts.checks import Array
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.basis import features
from kendama_cli.motion.integration import Solution, settle, solve
from kendama_cli.motion.phase import phase

STEPS = 1000
"""Runge-Kutta steps per motion: the error is below 1e-9 of the motion's size for K up to 10 000."""


@dataclass(frozen=True)
class DmpMotion:
    """A motion at n instants; every array is (n, coordinates)."""

    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array


def forcing(plan: MotionPlan, share: Array) -> Array:
    """f of eq. 5 at ``share`` s = t / tau (n,) in [0, 1]; returns (n, coordinates)."""
    return features(phase(share, plan.phase_decay), plan.centers, plan.widths) @ plan.weights.T


def play(plan: MotionPlan, t_s: Array, *, steps: int = STEPS) -> DmpMotion:
    """The motion at the instants ``t_s`` (n,) after its start, in any order and spacing.

    Before the start the motion rests; at the start it takes the demonstration's own velocity; after
    ``tau_scale * duration_s`` it settles on the goal with f = 0. ``steps`` is the number of integration steps.
    """
    tau_s = plan.tau_scale * plan.duration_s
    share = np.asarray(t_s, dtype=np.float64) / tau_s
    solution = _solution(plan, steps)
    inside = solution.at(np.clip(share, 0.0, 1.0))
    end = solution.at(np.ones(1))
    after = settle(end.position[0], end.rate[0], plan.goal_m, solution.frequency, np.maximum(share - 1.0, 0.0))
    past = (share > 1.0)[:, None]
    ahead = (share < 0.0)[:, None]
    rate = np.where(ahead, 0.0, np.where(past, after.rate, inside.rate))
    second = np.where(ahead, 0.0, np.where(past, after.second, inside.second))
    return DmpMotion(np.where(past, after.position, inside.position), rate / tau_s, second / tau_s**2)


def _solution(plan: MotionPlan, steps: int) -> Solution:
    pull = plan.stiffness * plan.goal_m
    return solve(
        lambda share: pull + forcing(plan, share),
        plan.start_m,
        plan.start_velocity_m_s * plan.duration_s,
        float(np.sqrt(plan.stiffness)),
        steps,
    )
