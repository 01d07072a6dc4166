"""Swing the ball to a wanted angle and rate: an energy pump beside chance, on Gymnasium's SwingUpGoal."""

import math

import gymnasium
import numpy as np

ROPE_M, GRAVITY_M_S2 = 0.4, 9.81
GAIN, STIFFNESS_PER_M, DAMPING_S_M = 8.0, 2.0, 0.5
EPISODES, FIRST_SEED = 30, 0
environment = gymnasium.make("kendama_cli.gym:kendama/SwingUpGoal-v1")


def energy(angle_rad: float, rate_rad_s: float) -> float:
    """Return the ball's energy over hanging still, in weights times rope lengths."""
    return 1.0 - math.cos(angle_rad) + 0.5 * ROPE_M / GRAVITY_M_S2 * rate_rad_s**2


def pump(observation: dict[str, np.ndarray]) -> np.ndarray:
    """Return the fraction of the largest acceleration that brings ball to the goal's energy and cup to the centre."""
    x_m, velocity_m_s, angle_rad, rate_rad_s, _ = observation["observation"].tolist()
    missing = energy(*observation["desired_goal"].tolist()) - energy(angle_rad, rate_rad_s)
    push = -GAIN * missing * math.cos(angle_rad) * math.copysign(1.0, rate_rad_s)
    return np.array([np.clip(push - STIFFNESS_PER_M * x_m - DAMPING_S_M * velocity_m_s, -1.0, 1.0)], np.float32)


def reached(by_pump: bool) -> int:
    """Count the goals reached, one an episode."""
    successes = 0
    for seed in range(FIRST_SEED, FIRST_SEED + EPISODES):
        environment.action_space.seed(seed)
        observation, info = environment.reset(seed=seed)
        ended = False
        while not ended:
            action = pump(observation) if by_pump else environment.action_space.sample()
            observation, _, terminated, truncated, info = environment.step(action)
            ended = terminated or truncated
        successes += info["is_success"]
    return successes


if __name__ == "__main__":  # so that the law can be imported
    print(reached(True), "of", EPISODES, "goals by the pump,", reached(False), "by chance")
