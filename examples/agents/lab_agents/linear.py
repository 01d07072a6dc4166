"""Cross-entropy search of a linear policy, in NumPy alone."""

import numpy as np


class LinearAgent:
    """The action is tanh of a weighted sum of four features of a normalised observation."""

    def __init__(self, environment, seed):
        self.environment, self.rng = environment, np.random.default_rng(seed)
        self.mean, self.spread = np.zeros(4), np.full(4, 2.0)

    def learn(self, total_timesteps):
        """Try generations of 20 weights, and move to the best five of each."""
        steps = 0
        while steps < total_timesteps:
            drawn = self.mean + self.spread * self.rng.standard_normal((20, 4))
            scores = np.zeros(20)
            for i, weights in enumerate(drawn):
                scores[i], taken = self.episode(weights)
                steps += taken
            best = drawn[np.argsort(scores)[-5:]]
            self.mean, self.spread = best.mean(axis=0), best.std(axis=0) + 0.1
        return self

    def episode(self, weights):
        """Return the sum of rewards, and the number of steps."""
        observation, _ = self.environment.reset()
        returned, steps, over = 0.0, 0, False
        while not over:
            observation, reward, terminated, truncated, _ = self.environment.step(self.action(weights, observation))
            returned, steps, over = returned + reward, steps + 1, terminated or truncated
        return returned, steps

    def action(self, weights, observation):
        """Return a continuous action (1,)."""
        x, velocity, angle, rate, _ = observation
        features = x, velocity, np.sin(np.pi * angle), rate * np.cos(np.pi * angle)
        return np.array([np.tanh(np.dot(weights, features))])

    def predict(self, observation):
        """Return the action of the mean weights."""
        return self.action(self.mean, observation)

    def state_dict(self):
        """Return what was learned."""
        return {"mean": self.mean}

    def load_state_dict(self, arrays):
        """Restore it."""
        self.mean = arrays["mean"]
