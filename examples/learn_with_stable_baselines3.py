"""Deep learners in Catch-v0: python examples/learn_with_stable_baselines3.py [dqn|ppo|sac] [STEPS] [SEEDS]

Needs: ``pip install '.[gym]' stable-baselines3``. Judged in 200 episodes that no learner saw, beside an untrained
policy (its cup hardly moves: what falls into a cup at rest). A reward above 0 is no catch: a near miss has some too.
"""

import sys
from typing import Any

import gymnasium
import numpy as np
from stable_baselines3 import DQN, PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm

import kendama_cli.gym  # noqa: F401 - registers the environments

name = sys.argv[1] if len(sys.argv) > 1 else "dqn"
steps = int(sys.argv[2]) if len(sys.argv) > 2 else 50_000
seeds = int(sys.argv[3]) if len(sys.argv) > 3 else 10
SLOW_DECAY = {"learning_rate": 1e-3, "exploration_fraction": 0.5, "target_update_interval": 1000}
LEARNERS: dict[str, tuple[type[BaseAlgorithm], str, dict[str, Any]]] = {
    "dqn": (DQN, "discrete", SLOW_DECAY),
    "ppo": (PPO, "continuous", {"n_steps": 1024, "batch_size": 256}),
    "sac": (SAC, "continuous", {"train_freq": 8}),
}


def environment(actions: str) -> gymnasium.Env:
    """Make the game for one agent."""
    return gymnasium.make("kendama/Catch-v0", actions=actions, normalised=True)


def caught(learner: BaseAlgorithm, actions: str) -> float:
    """Return the fraction of 200 episodes that the policy catches."""
    judged, successes = environment(actions), 0
    for episode in range(200):
        observation, _ = judged.reset(seed=1_000_000 + episode)
        over = False
        while not over:
            action, _ = learner.predict(observation, deterministic=True)
            observation, _, terminated, truncated, info = judged.step(action)
            over = terminated or truncated
        successes += info["is_success"]
    return successes / 200


algorithm, actions, options = LEARNERS[name]
shares = []
for seed in range(seeds):
    # an episode is over within a second: what a catch is worth does not fade
    learner = algorithm("MlpPolicy", environment(actions), seed=seed, gamma=1.0, **options)
    before = caught(learner, actions)
    shares.append((before, caught(learner.learn(steps), actions)))
    print(f"seed {seed}: {before:.2f} untrained, {shares[-1][1]:.2f} after {steps} steps", flush=True)
before, after = np.transpose(shares)
drawn = np.random.default_rng(0).choice(after, (10_000, seeds)).mean(1)
low, high = np.percentile(drawn, [2.5, 97.5])
print(f"{name}: {after.mean():.2f} (95 %: {low:.2f} to {high:.2f}) caught, worst seed {after.min():.2f}")
print(f"untrained: {before.mean():.2f}")
