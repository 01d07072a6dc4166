"""Learn to catch a falling ball with DQN: python examples/learn_with_stable_baselines3.py [STEPS]

Needs: pip install 'kendama[gym]' stable-baselines3
"""

import sys

import gymnasium
from stable_baselines3 import DQN
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor

import kendama_cli.gym  # noqa: F401 - registers the environments

steps = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
environment = gymnasium.make("kendama/Catch-v0", actions="discrete", normalised=True)
check_env(environment.unwrapped)
learner = DQN("MlpPolicy", Monitor(environment), learning_starts=1000, seed=0)
learner.learn(steps)
judged = Monitor(gymnasium.make("kendama/Catch-v0", actions="discrete", normalised=True))
rewards, _ = evaluate_policy(learner, judged, n_eval_episodes=200, return_episode_rewards=True)
print(f"{steps} steps: {sum(reward > 0 for reward in rewards)} of {len(rewards)} caught")
