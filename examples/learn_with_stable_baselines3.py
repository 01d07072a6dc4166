"""Deep learners in Catch-v0, several seeds each: python examples/learn_with_stable_baselines3.py [STEPS] [SEEDS]

Needs: pip install 'kendama[gym]' stable-baselines3. Judged in 200 episodes that no learner saw, beside an untrained
policy (its cup hardly moves: what falls into a cup at rest). A reward above 0 is no catch: a near miss has some too.
"""

import sys

import gymnasium
import numpy as np
from stable_baselines3 import DQN, PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm

import kendama_cli.gym  # noqa: F401 - registers the environments

steps = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
seeds = int(sys.argv[2]) if len(sys.argv) > 2 else 10
LEARNERS: dict[str, tuple[type[BaseAlgorithm], str]] = {
    "DQN": (DQN, "discrete"),
    "PPO": (PPO, "continuous"),
    "SAC": (SAC, "continuous"),
}


def environment(actions: str) -> gymnasium.Env:
    """The game for one agent."""
    return gymnasium.make("kendama/Catch-v0", actions=actions, normalised=True)


def caught(learner: BaseAlgorithm, actions: str) -> float:
    """The share of 200 episodes that the policy catches."""
    judged, successes = environment(actions), 0
    for episode in range(200):
        observation, _ = judged.reset(seed=1_000_000 + episode)
        over = False
        while not over:
            action, _ = learner.predict(observation, deterministic=True)
            observation, _, terminated, truncated, info = judged.step(action)
            over = terminated or truncated
        successes += info["success"]
    return successes / 200


for name, (algorithm, actions) in LEARNERS.items():
    shares = []
    for seed in range(seeds):
        learner = algorithm("MlpPolicy", environment(actions), seed=seed)
        before = caught(learner, actions)
        shares.append((before, caught(learner.learn(steps), actions)))
        print(f"{name} seed {seed}: {before:.2f} untrained, {shares[-1][1]:.2f} after {steps} steps", flush=True)
    before, after = np.transpose(shares)
    drawn = np.random.default_rng(0).choice(after, (10_000, seeds)).mean(1)
    low, high = np.percentile(drawn, [2.5, 97.5])
    print(f"{name}: {after.mean():.2f} (95 %: {low:.2f} to {high:.2f}) caught, worst seed {after.min():.2f}")
