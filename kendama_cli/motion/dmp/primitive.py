"""Dynamic movement primitives, and playing them (equations.md eq. 3-5).

    v' = (K (g - y) - D v + f(x)) / tau,   y' = v / tau,   D = 2 sqrt K                          (3)
    x' = -alpha x / tau,   x(0) = 1                                                             (4)
    f(x) = x sum_j w_j psi_j(x) / sum_j psi_j(x),   psi_j = exp(-(x - c_j)^2 / (2 s_j^2))       (5)

A motion that does not end at rest has a goal that moves with it (``GoalPath``; J. Kober, K. Muelling and others,
"Movement templates for learning of hitting and batting", ICRA 2010): K (g(s) - y) + D (tau g' - v) stands for
K (g - y) - D v in eq. 3; where the goal velocity is zero this is eq. 3. After tau, f = 0 and the motion stays on
its goal, which comes to rest if it still moves.

Notation, and the names in code (a ``MotionPlan`` holds all of them):

    y, v        position and scaled velocity tau y' of one coordinate; c coordinates share x and tau   position_m
    g, g'       goal, and the velocity with which the motion passes it at tau              goal_m, goal_velocity_m_s
    y(0), y'(0) start, and the velocity with which the motion begins                    start_m, start_velocity_m_s
    K, D        stiffness and critical damping, in units of 1 / tau^2 and 1 / tau                         stiffness
    tau         time that the motion takes: T of the demonstration times a scale             duration_s, tau_scale
    s           share t / tau of the motion that has passed                                                   share
    x, alpha    phase exp(-alpha s), and its decay                                                      phase_decay
    f           forcing term                                                                                forcing
    w_j         weights, (c, m)                                                                             weights
    psi_j, c_j, s_j   basis functions, their centres in x (equal in time), their widths             centers, widths

Files: ``basis`` (eq. 4 and 5), ``integration`` (eq. 3), ``encoding`` and ``position_fit`` (weights from a
demonstration), ``onset`` (its motion), ``averaging`` (many demonstrations), ``turning`` (orientation), ``heading``
(the swing's plane), ``plan_text`` (JSON and YAML).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.dmp.basis import features, phase
from kendama_cli.motion.dmp.integration import Solution, settle, solve
from kendama_cli.schema.arrays import Array

ROLL_OUT = 0.15
"""Fraction of the duration in which a goal that still moves at the end comes to rest, by half of that way."""


@dataclass(frozen=True)
class GoalPath:
    """The goal at n instants; every array is (n, k), derivatives are by s = t / tau."""

    position: Array
    rate: Array
    second: Array


def goal_path(share: Array, goal: Array, goal_rate: Array) -> GoalPath:
    """Return the goal at fraction ``share`` s (n,): g + g' (s - 1) up to s = 1, then rolling out to g + g' ROLL_OUT
    / 2.

    The rate then is g' (1 - u)^2 (1 + 2 u), u = (s - 1) / ROLL_OUT: it leaves g' and comes to rest without a jump
    of the acceleration. ``goal`` and ``goal_rate`` are (k,).
    """
    s = np.asarray(share, dtype=np.float64)[:, None]
    ahead = np.minimum(s - 1.0, 0.0)
    u = np.clip((s - 1.0) / ROLL_OUT, 0.0, 1.0)
    rolled = ROLL_OUT * (u - u**3 + u**4 / 2)
    rate = (1 - u) ** 2 * (1 + 2 * u)
    second = -6 * u * (1 - u) / ROLL_OUT
    return GoalPath(goal + goal_rate * (ahead + rolled), goal_rate * rate, goal_rate * second)


STEPS = 1000
"""Runge-Kutta steps per motion: the error is below 1e-9 of the motion's size for K up to 10 000."""


@dataclass(frozen=True)
class DmpMotion:
    """A motion at n instants; every array is (n, coordinates)."""

    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array


def forcing(plan: MotionPlan, share: Array) -> Array:
    """Return f of eq. 5 at fraction ``share`` s = t / tau (n,) in [0, 1]; (n, coordinates)."""
    return features(phase(share, plan.phase_decay), plan.centers, plan.widths) @ plan.weights.T


def play(plan: MotionPlan, t_s: Array, *, steps: int = STEPS) -> DmpMotion:
    """Return the motion at the times ``t_s`` (n,) after its start, in any order and spacing.

    Before the start the motion rests; at the start it takes the demonstration's own velocity; after
    ``tau_scale * duration_s`` it stays on its goal with f = 0. ``steps`` is the number of integration steps.
    """
    tau_s = plan.tau_scale * plan.duration_s
    fraction = np.asarray(t_s, dtype=np.float64) / tau_s
    goal = goal_path(np.maximum(fraction, 0.0), plan.goal_m, plan.goal_velocity_m_s * plan.duration_s)
    # what is integrated is the distance to the goal: e'' + D e' + K e = f, the goal moves evenly or f = 0
    solution = _to_goal(plan, steps)
    inside = solution.at(np.clip(fraction, 0.0, 1.0))
    end = solution.at(np.ones(1))
    after = settle(end.position[0], end.rate[0], solution.frequency, np.maximum(fraction - 1.0, 0.0))
    past = (fraction > 1.0)[:, None]
    ahead = (fraction < 0.0)[:, None]
    position = goal.position + np.where(past, after.position, inside.position)
    rate = np.where(ahead, 0.0, goal.rate + np.where(past, after.rate, inside.rate))
    second = np.where(ahead, 0.0, goal.second + np.where(past, after.second, inside.second))
    return DmpMotion(np.where(ahead, plan.start_m, position), rate / tau_s, second / tau_s**2)


def _to_goal(plan: MotionPlan, steps: int) -> Solution:
    rate = plan.goal_velocity_m_s * plan.duration_s
    return solve(
        lambda share: forcing(plan, share),
        plan.start_m - (plan.goal_m - rate),
        plan.start_velocity_m_s * plan.duration_s - rate,
        float(np.sqrt(plan.stiffness)),
        steps,
    )


def parameters(plan: MotionPlan) -> Array:
    """Return log T, start rate, goal - start, goal rate (a rate is velocity x T) and weights; (1 + c (3 + m),)."""
    return np.concatenate(
        (
            [np.log(plan.duration_s)],
            plan.start_velocity_m_s * plan.duration_s,
            plan.goal_m - plan.start_m,
            plan.goal_velocity_m_s * plan.duration_s,
            plan.weights.ravel(),
        )
    )


def with_parameters(plan: MotionPlan, values: Array) -> MotionPlan:
    """Return ``plan`` with the parameters ``values``, in the order of ``parameters``."""
    c = len(plan.coordinates)
    duration = float(np.exp(values[0]))
    start_rate, path, goal_rate = values[1 : 1 + 3 * c].reshape(3, c)
    return dataclasses.replace(
        plan,
        duration_s=duration,
        start_velocity_m_s=start_rate / duration,
        goal_m=plan.start_m + path,
        goal_velocity_m_s=goal_rate / duration,
        weights=values[1 + 3 * c :].reshape(plan.weights.shape),
    )


def covariance(plan: MotionPlan) -> Array:
    """Return the covariance of the parameters over the demonstrations that ``plan`` averages; zeros for one."""
    made: Array = plan.variation.T @ plan.variation
    return made


def sample_plan(plan: MotionPlan, rng: np.random.Generator, scale: float = 1.0) -> MotionPlan:
    """Sample a swing from the normal distribution with mean ``plan`` and ``scale``^2 times its covariance.

    The parameters vary together as they did over the demonstrations, so what is drawn is again a swing of their kind.
    """
    sampled = rng.standard_normal(len(plan.variation)) @ plan.variation
    return dataclasses.replace(
        with_parameters(plan, parameters(plan) + scale * sampled), variation=np.zeros((0, plan.variation.shape[1]))
    )
