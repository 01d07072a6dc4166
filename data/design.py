"""Finds the swing of ``generate.py``: ``python data/design.py [GENERATIONS]`` prints five minimum-jerk movements.

A point-mass ball on the rope of conf/game/kendama.yaml (PAPER.md eq. 1) follows an ideally moved cup; many candidates
are simulated at once, each at seven tempos, and an evolution strategy keeps those whose ball crosses the rim plane
nearest to the middle at the worst tempo, with bounded speed, acceleration and extent.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

ROPE_M, STIFFNESS_N_M, DAMPING_N_S_M = 0.40, 2000.0, 2.0
MASS_KG, DRAG_N_S_M, GRAVITY_M_S2 = 0.05, 0.002, 9.81
PLANE_M = 0.07 + 0.02
"""The rim over the tie point, and one ball radius more: before any contact."""
BLOCKED_M = 0.075
"""A rising ball nearer to the cup's axis than this would hit it."""
STEP_S = 1e-3
HORIZON_S = 2.55
TEMPOS = np.array([0.95, 0.97, 0.985, 1.0, 1.015, 1.03, 1.05])
FIRST = np.array(
    [[0.38, 0.24, 0.75], [-0.55, 0.56, 0.97], [-0.09, 0.86, 0.45], [0.34, 1.14, 0.62], [-0.27, 1.40, 0.96]]
)
"""Size [m], start [s] and duration [s] of two movements along x and three along z."""
AXES = (0, 0, 2, 2, 2)


@dataclass(frozen=True)
class Crossing:
    """Where each of b balls falls through the rim's plane, relative to the cup; every array is (b,) or (b, 3)."""

    crossed: np.ndarray
    offset_m: np.ndarray
    velocity_m_s: np.ndarray
    apex_m: np.ndarray
    blocked: np.ndarray


def fly(cup_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The balls' positions and velocities relative to cups that move as ``cup_m`` (steps, b, 3) in steps of 1 ms."""
    velocity = np.gradient(cup_m, STEP_S, axis=0)
    ball = cup_m[0] - np.array([0.0, 0.0, ROPE_M + MASS_KG * GRAVITY_M_S2 / STIFFNESS_N_M])
    speed = np.zeros_like(ball)
    away, rate = np.empty_like(cup_m), np.empty_like(cup_m)
    for i in range(len(cup_m)):
        away[i], rate[i] = ball - cup_m[i], speed - velocity[i]
        length = np.sqrt(np.sum(away[i] * away[i], axis=1))
        along = away[i] / length[:, None]
        stretch = length - ROPE_M
        pull = STIFFNESS_N_M * stretch + DAMPING_N_S_M * np.sum(rate[i] * along, axis=1)
        pull = np.where((stretch > 0) & (pull > 0), pull, 0.0)  # a rope never pushes
        force = -pull[:, None] * along - DRAG_N_S_M * speed - np.array([0.0, 0.0, MASS_KG * GRAVITY_M_S2])
        speed = speed + STEP_S * force / MASS_KG
        ball = ball + STEP_S * speed
    return away, rate


def crossing(away: np.ndarray, rate: np.ndarray) -> Crossing:
    """The first fall through the rim's plane."""
    height = away[:, :, 2]
    falls = (height[:-1] > PLANE_M) & (height[1:] <= PLANE_M)
    crossed = falls.any(axis=0)
    step = np.where(crossed, falls.argmax(axis=0), len(height) - 2)
    ball = np.arange(height.shape[1])
    above, below = height[step, ball], height[step + 1, ball]
    share = np.where(crossed, (above - PLANE_M) / np.where(crossed, above - below, 1.0), 0.0)
    offset = away[step, ball] + share[:, None] * (away[step + 1, ball] - away[step, ball])
    before = np.arange(len(height))[:, None] < step - 3
    near = np.hypot(away[:, :, 0], away[:, :, 1]) < BLOCKED_M
    blocked = (near & (height > -0.03) & (height < PLANE_M) & before).any(axis=0)
    return Crossing(crossed, offset, rate[step, ball], np.where(before, height, -1.0).max(axis=0), blocked)


def cups(swings: np.ndarray) -> np.ndarray:
    """The cups of ``swings`` (b, 5, 3), played at 1 ms: (steps, b, 3)."""
    t_s = np.arange(round(HORIZON_S / STEP_S)) * STEP_S
    made = np.zeros((len(t_s), len(swings), 3))
    for k, axis in enumerate(AXES):
        size, start, duration = swings[:, k].T
        u = np.clip((t_s[:, None] - start) / duration, 0.0, 1.0)
        made[:, :, axis] += size * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    return made


def cost(swings: np.ndarray) -> np.ndarray:
    """What each of ``swings`` (b, 5, 3) is worth; (b,), smaller is better."""
    count = len(swings)
    played = np.concatenate([swings * np.array([1.0, tempo, tempo]) for tempo in TEMPOS])
    path = cups(played)
    fall = crossing(*fly(path))
    # the ball moves on sideways while it falls past the rim
    miss = np.abs(fall.offset_m[:, 0] + 0.012 * fall.velocity_m_s[:, 0])
    each = np.where(fall.crossed, 60 * miss + np.abs(fall.velocity_m_s[:, 0]) + 3 * fall.blocked, 20.0)
    each = each.reshape(len(TEMPOS), count)
    nominal = path[:, 3 * count : 4 * count]
    velocity = np.gradient(nominal, STEP_S, axis=0)
    acceleration = np.linalg.norm(np.gradient(velocity, STEP_S, axis=0), axis=2)
    extent = np.abs(nominal).max(axis=(0, 2))
    apex = fall.apex_m.reshape(len(TEMPOS), count).min(axis=0)
    start, duration = swings[:, :, 1], swings[:, :, 2]
    return (
        each.max(axis=0)
        + each.mean(axis=0)
        + 20 * np.maximum(np.linalg.norm(velocity, axis=2).max(axis=0) - 1.05, 0)
        + 3 * np.maximum(acceleration.max(axis=0) - 6.8, 0)
        + 0.3 * np.sqrt(np.mean(acceleration**2, axis=0))
        + 60 * np.maximum(extent - 0.28, 0)
        + 50 * np.maximum(0.08 - apex, 0)
        + 30 * np.maximum(0.15 - start.min(axis=1), 0)
        + 30 * np.maximum(duration.max(axis=1) - 1.0, 0)
        + 30 * np.maximum(0.4 - duration.min(axis=1), 0)
        + 30 * np.maximum((start + duration).max(axis=1) - 2.2, 0)
    )


def search(rng: np.random.Generator, generations: int) -> np.ndarray:
    """The best swing (5, 3) of a covariance-adapting evolution strategy (Hansen, The CMA evolution strategy)."""
    size, offspring, parents = FIRST.size, 40, 20
    share = np.log(parents + 0.5) - np.log(np.arange(1, parents + 1))
    share /= share.sum()
    effective = 1 / np.sum(share**2)
    rate_path = (4 + effective / size) / (size + 4 + 2 * effective / size)
    rate_step = (effective + 2) / (size + effective + 5)
    rate_one = 2 / ((size + 1.3) ** 2 + effective)
    rate_many = min(1 - rate_one, 2 * (effective - 2 + 1 / effective) / ((size + 2) ** 2 + effective))
    mean, step = FIRST.ravel(), 0.03
    covariance, path, step_path = np.eye(size), np.zeros(size), np.zeros(size)
    best, best_cost = mean, np.inf
    for _ in range(generations):
        values, vectors = np.linalg.eigh(covariance)
        roots = np.sqrt(np.maximum(values, 1e-14))
        moves = (rng.standard_normal((offspring, size)) * roots) @ vectors.T
        costs = cost((mean + step * moves).reshape(offspring, *FIRST.shape))
        order = np.argsort(costs)
        if costs[order[0]] < best_cost:
            best, best_cost = mean + step * moves[order[0]], costs[order[0]]
        chosen = moves[order[:parents]]
        move = share @ chosen
        mean = mean + step * move
        whitened = vectors @ ((vectors.T @ move) / roots)
        step_path = (1 - rate_step) * step_path + np.sqrt(rate_step * (2 - rate_step) * effective) * whitened
        path = (1 - rate_path) * path + np.sqrt(rate_path * (2 - rate_path) * effective) * move
        spread = (chosen.T * share) @ chosen
        covariance = (1 - rate_one - rate_many) * covariance + rate_one * np.outer(path, path) + rate_many * spread
        step *= np.exp(rate_step / (1 + rate_step) * (np.linalg.norm(step_path) / np.sqrt(size) - 1))
    return best.reshape(FIRST.shape)


if __name__ == "__main__":
    found = search(np.random.default_rng(0), int(sys.argv[1]) if len(sys.argv) > 1 else 300)
    for axis, (size_m, start_s, duration_s) in zip(AXES, found, strict=True):
        sys.stdout.write(f"Movement({axis}, {size_m:.4f}, {start_s:.4f}, {duration_s:.4f})\n")
    sys.stdout.write(f"cost {cost(found[None])[0]:.3f}\n")
