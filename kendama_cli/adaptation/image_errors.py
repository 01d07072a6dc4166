"""Images of a simulated sensor, with the errors of a laboratory's cameras."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class SensorErrors:
    """Errors of the images of one simulation, as UncertaintySettings declares them.

    They show what was ``latency_s`` before their stamps; ``seed`` is that of the images which are repeated or wrong.
    """

    latency_s: float = 0.0
    repeated: float = 0.0
    repeated_stamp_s: float = 0.0
    wrong: float = 0.0
    wrong_m: float = 0.0
    seed: int = 0


EXACT = SensorErrors()
"""Errors of a sensor that is only noisy."""
STREAM = 3
"""Random stream of the images that are repeated or wrong, which leaves the noise as it is."""


class ImageErrors:
    """Images of a sensor with standard deviations ``sigma_m`` (3,), noise from ``rng``, and ``errors``."""

    def __init__(self, errors: SensorErrors, sigma_m: Array, rng: np.random.Generator) -> None:
        self._errors, self._sigma_m, self._rng = errors, sigma_m, rng
        self._chance = np.random.default_rng([errors.seed, STREAM])
        self._last: tuple[float, Array] | None = None

    def image(self, t_s: float, ball_m: Array) -> tuple[float, Array]:
        """Return the stamp of the image exposed at ``t_s``, and where the ball (3,), at ``ball_m``, is seen in it.

        A repeated image shows what the one before showed, so that all of ``t_s`` is lost. A wrong detection is off in a
        direction that is uniform on the sphere.
        """
        errors, chance = self._errors, self._chance
        seen_m = ball_m + self._sigma_m * self._rng.standard_normal(3)
        stamp_s = t_s + errors.latency_s
        if errors.wrong > 0 and chance.random() < errors.wrong:
            direction = chance.standard_normal(3)
            seen_m = seen_m + errors.wrong_m * direction / np.linalg.norm(direction)
        if errors.repeated > 0 and self._last is not None and chance.random() < errors.repeated:
            stamp_s, seen_m = self._last[0] + errors.repeated_stamp_s, self._last[1]
        self._last = stamp_s, seen_m
        return self._last
