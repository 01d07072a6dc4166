"""Random actions in the swing-up's environment: what chance reaches, beside which any learner should be read."""

import kendama_cli as kendama

environment = kendama.environment()
environment.action_space.seed(1)
reached = 0
for episode in range(20):
    environment.reset(seed=episode)
    ended = False
    while not ended:
        _, _, terminated, truncated, info = environment.step(environment.action_space.sample())
        ended = terminated or truncated
    reached += info["is_success"]
print(reached, "of 20 random rollouts reached the goal")
