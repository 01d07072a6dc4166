"""What a tracking system tells of ball and cup: noisy, drifting, late, and sometimes nothing new."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.settings.robot import Imperfection


class ImperfectTracking:
    """Tells places (k, 3) of k markers, one reading every ``period_s``; all errors are drawn from ``rng``.

    To white noise comes an error of the same size at all times that forgets itself over ``drift_s``:

        e' = a e + sqrt(1 - a^2) drift_m n,   a = exp(-period_s / drift_s), n standard normal

    Then the reading is told ``tracking_delay_s`` late, or, where it is lost, the one before it again.
    """

    def __init__(self, errors: Imperfection, period_s: float, rng: np.random.Generator) -> None:
        self._errors, self._rng = errors, rng
        self._keep = math.exp(-period_s / errors.drift_s)
        self._late = round(errors.tracking_delay_s / period_s)
        self._drift: Array | None = None
        self._waiting: list[Array] = []

    def told(self, places_m: Array) -> Array:
        """What is told (k, 3) when the markers are at ``places_m`` (k, 3)."""
        made, rng = self._errors, self._rng
        if made.ball_noise_m > 0:
            places_m = places_m + rng.normal(0.0, made.ball_noise_m, places_m.shape)
        if made.drift_m > 0:
            new = rng.normal(0.0, made.drift_m, places_m.shape)
            self._drift = new if self._drift is None else self._keep * self._drift + math.sqrt(1 - self._keep**2) * new
            places_m = places_m + self._drift
        lost = made.tracking_lost_share > 0 and rng.uniform() < made.tracking_lost_share
        self._waiting.append(self._waiting[-1] if lost and self._waiting else places_m)
        del self._waiting[: -self._late - 1]
        return self._waiting[0]
