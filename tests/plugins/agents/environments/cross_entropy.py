"""A small third-party agent, written against Gymnasium's interface alone: cross-entropy search of a linear policy.

python -m tests.plugins.agents.environments.cross_entropy trains it for a minute and prints how often it swings up.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np


@dataclass(frozen=True)
class LinearPolicy:
    """The action grows with a weighted sum of features of the reading."""

    weights: np.ndarray

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> LinearPolicy:
        """A policy by chance."""
        return cls(rng.standard_normal(4))

    def action(self, observation: np.ndarray, n_actions: int) -> int:
        """0..n_actions-1."""
        x, velocity, angle, rate, _ = observation
        features = np.array([3.0 * x, velocity, np.sin(angle), rate * np.cos(angle) / 5.0])
        desired = np.tanh(float(self.weights @ features))
        return round((desired + 1.0) / 2.0 * (n_actions - 1))


def played(env: gymnasium.Env[Any, Any], policy: LinearPolicy, seed: int) -> tuple[float, bool]:
    """One rollout: how high the ball came in the end, or more for the goal, the sooner the better; and whether."""
    observation, _ = env.reset(seed=seed)
    steps, highest = 0, 0.0
    while True:
        observation, _, terminated, truncated, info = env.step(policy.action(observation, env.action_space.n))
        steps += 1
        highest = max(highest, abs(float(observation[2])))
        if terminated or truncated:
            return (10.0 - 0.02 * steps if info["is_success"] else highest), bool(info["is_success"])


def improved(
    env: gymnasium.Env[Any, Any], rng: np.random.Generator, *, generations: int, population: int
) -> LinearPolicy:
    """The mean of a normal distribution of weights, drawn to its best quarter in each generation."""
    mean, spread = np.zeros(4), np.full(4, 2.0)
    for _ in range(generations):
        sampled = mean + spread * rng.standard_normal((population, 4))
        scores = [
            np.mean([played(env, LinearPolicy(weights), int(rng.integers(2**31)))[0] for _ in range(2)])
            for weights in sampled
        ]
        best = sampled[np.argsort(scores)[-population // 4 :]]
        mean, spread = best.mean(axis=0), best.std(axis=0) + 0.1
    return LinearPolicy(mean)


if __name__ == "__main__":
    env = gymnasium.make("kendama_cli.gym:kendama/SwingUp-v1", hold_s=0.05)
    policy = improved(env, np.random.default_rng(0), generations=12, population=32)
    print("swung up", np.mean([played(env, policy, seed)[1] for seed in range(1000, 1100)]), "of 100 rollouts")
