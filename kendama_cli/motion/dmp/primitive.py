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
    s           fraction t / tau of the motion that has passed                                                   share
    x, alpha    phase exp(-alpha s), and its decay                                                      phase_decay
    f           forcing term                                                                                forcing
    w_j         weights, (c, m)                                                                             weights
    psi_j, c_j, s_j   basis functions, their centres in x (equal in time), their widths             centers, widths

Files: ``basis`` (eq. 4 and 5), ``encoding`` and ``position_fit`` (weights from a
demonstration), ``onset`` (its motion), ``averaging`` (many demonstrations), ``turning`` (orientation), ``heading``
(the swing's plane), ``plan_text`` (JSON and YAML).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dtbtrs

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.dmp.basis import features, phase
from kendama_cli.schema.arrays import Array

Drive = Callable[[Array], Array]
"""r at instants s (n,): (n, k) for k coordinates."""


@dataclass(frozen=True)
class State:
    """Position, rate and second derivative by s at n instants; every array is (n, k)."""

    position: Array
    rate: Array
    second: Array


@dataclass(frozen=True)
class Solution:
    """Nodes of the solution on s = 0 .. 1, readable at any s between by one further Runge-Kutta step."""

    drive: Drive
    frequency: float
    nodes: Array
    """(steps + 1, 2, k): y and u at s = i / steps."""
    driven: Array
    """(steps + 1, k): r there."""

    def at(self, share: Array) -> State:
        """Return the state at ``share`` (n,) of the motion, each in [0, 1]."""
        steps = len(self.nodes) - 1
        s = np.asarray(share, dtype=np.float64)
        node = np.clip(np.floor(s * steps).astype(np.int64), 0, steps - 1)
        start = node / steps
        h = (s - start)[:, None]
        y_gain, cross, u_gain = _free(h, self.frequency)
        drive = self.drive(s)
        push = _forced(h, self.frequency, self.driven[node], self.drive(start + h[:, 0] / 2), drive)
        y = y_gain * self.nodes[node, 0] + cross * self.nodes[node, 1] + push[0]
        u = u_gain * self.nodes[node, 1] + push[1]
        rate = u - self.frequency * y
        return State(y, rate, drive - 2 * self.frequency * rate - self.frequency**2 * y)


def solve(drive: Drive, start: Array, start_rate: Array, frequency: float, steps: int) -> Solution:
    """Integrate y'' + 2 w y' + w^2 y = r(s) over s = 0 .. 1 with ``steps`` classical Runge-Kutta steps of order 4.

    Eq. 3 in the motion's own time s = t / tau, w = sqrt K, for the distance to the goal. Critical damping lets it fall
    into two first-order lags, u = y' + w y:

        u' = -w u + r,    y' = -w y + u                                                      (linear, triangular)

    so that the whole solution is two recurrences of constant gain: a triangular band of equations for LAPACK.
    ``start`` and ``start_rate`` (k,) are y and dy/ds at s = 0; ``frequency`` is w.
    """
    grid = np.arange(steps + 1) / steps
    h = 1.0 / steps
    drives = drive(grid)
    push = _forced(np.array(h), frequency, drives[:-1], drive(grid[:-1] + h / 2), drives[1:])
    y_gain, cross, u_gain = (float(gain) for gain in _free(np.array(h), frequency))
    u = recur(u_gain, push[1], start_rate + frequency * start)
    y = recur(y_gain, push[0] + cross * u[:-1], start)
    return Solution(drive, frequency, np.stack((y, u), axis=1), drives)


def settle(start: Array, start_rate: Array, frequency: float, since: Array) -> State:
    """Return the exact free motion to zero: e = (e0 + (e0' + w e0) s) exp(-w s), s = ``since`` (n,); starts are
    (k,).
    """
    s = np.asarray(since, dtype=np.float64)[:, None]
    slope = start_rate + frequency * start
    fade = np.exp(-frequency * s)
    position = (start + slope * s) * fade
    rate = slope * fade - frequency * position
    return State(position, rate, -2 * frequency * rate - frequency**2 * position)


def recur(gain: float, push: Array, start: Array) -> Array:
    """Return z_{i+1} = gain z_i + push_i from z_0 = ``start`` (k,); (n + 1, k)."""
    right = np.vstack((start, push))
    # unit diagonal, -gain below it; scipy.signal's filter does the same and takes half a second to import
    band = np.array([[1.0], [-gain]]).repeat(len(right), axis=1)
    return np.asarray(dtbtrs(band, right, uplo="L", diag="U")[0])


def _free(h: Array, w: float) -> tuple[Array, Array, Array]:
    """Return one step without drive, sum (hA)^k / k! for k = 0 .. 4 with A = [[-w, 1], [0, -w]]: (y to y, u to y, u
    to u).
    """
    d = -w * h
    gain = 1 + d + d**2 / 2 + d**3 / 6 + d**4 / 24
    return gain, h * (1 + d + d**2 / 2 + d**3 / 6), gain


def _forced(h: Array, w: float, begin: Array, center: Array, end: Array) -> tuple[Array, Array]:
    """Return the effect on y and on u of one step from rest under the drive at its start, centre and end.

    With M = h A / 2: h/6 [(1 + 2M + 2M^2 + 2M^3) b0 + (4 + 4M + 2M^2) b1 + b2], b = (0, r). M^k has d^k on the
    diagonal, d = -w h / 2, and k d^(k-1) h / 2 above it.
    """
    d = -w * h / 2
    to_u = h / 6 * ((1 + 2 * d + 2 * d**2 + 2 * d**3) * begin + (4 + 4 * d + 2 * d**2) * center + end)
    to_y = h / 6 * (h / 2) * ((2 + 4 * d + 6 * d**2) * begin + (4 + 4 * d) * center)
    return to_y, to_u


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
