"""Catch a ball that was just let go: a law written by hand beside a cup that stands still, on Gymnasium's Catch."""

import math

import gymnasium
import numpy as np

GRAVITY_M_S2, RIM_M, LARGEST_M_S2 = 9.81, 0.07, 3.25

environment = gymnasium.make("kendama_cli.gym:kendama/Catch-v0")


def law(observation: np.ndarray) -> np.ndarray:
    """Return the constant acceleration with which the cup meets a freely falling ball, as a fraction of the largest."""
    _, _, across_m, above_m, across_m_s, above_m_s, _ = observation
    root = above_m_s**2 + 2.0 * GRAVITY_M_S2 * (above_m - RIM_M)
    fall_s = (above_m_s + math.sqrt(max(root, 0.0))) / GRAVITY_M_S2
    wanted_m_s2 = 2.0 * (across_m + across_m_s * fall_s) / max(fall_s, 0.01) ** 2
    return np.array([np.clip(wanted_m_s2 / LARGEST_M_S2, -1.0, 1.0)], np.float32)


def caught(acts_by_law: bool) -> int:
    """Count the catches of 50 balls."""
    successes = 0
    for seed in range(50):
        observation, info = environment.reset(seed=seed)
        ended = False
        while not ended:
            action = law(observation) if acts_by_law else np.zeros(1, np.float32)
            observation, _, terminated, truncated, info = environment.step(action)
            ended = terminated or truncated
        successes += info["is_success"]
    return successes


print(caught(True), "of 50 by the law,", caught(False), "with the cup standing still")
