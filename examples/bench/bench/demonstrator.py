"""Demonstrator that swings the cup like a clock's pendulum."""

import numpy as np

from kendama_cli.extension import DemonstratorSample

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


class Pendulum:
    def __init__(self, name, rate_hz):
        self.name, self.rate_hz = name, rate_hz

    def samples(self):
        for k in range(round(1.5 * self.rate_hz)):
            t_s = k / self.rate_hz
            x_m = 0.15 * (1 - np.cos(2 * np.pi * t_s / 1.5))
            yield DemonstratorSample(t_s, np.array([x_m, 0.0, 0.3 * x_m]), UPRIGHT, tracked=True)

    def render_force(self, force_n):
        """Ignore the force: there is nobody to feel it."""

    def close(self):
        """Do nothing: no device is open."""


def open_demonstrators(settings):
    return [Pendulum(f"swing {number}", settings.rate_hz) for number in range(settings.swings)]
