"""A small classifier of patches: a perceptron of two hidden layers, learned by Adam in numpy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float32]

HIDDEN = (48, 16)
LEAK = np.float32(0.01)
CLIPPED = 4.0
"""Standardised inputs beyond this come from what was never shown: they count as this."""
FIRST_RATE, LAST_RATE = 3e-3, 1e-4
DECAY = 1e-4
MOMENT, SQUARE = 0.9, 0.999


@dataclass(frozen=True)
class PatchClassifier:
    """log odds = W3 h(W2 h(W1 z + b1) + b2) + b3, with z the standardised features and h a leaky rectifier."""

    mean: Values
    """(features,)"""
    spread: Values
    """(features,) standard deviations"""
    weights: tuple[Values, ...]
    biases: tuple[Values, ...]

    def log_odds(self, features: Values) -> Values:
        """Return the log odds (n,) that patches with these ``features`` (n, features) show the ball."""
        values = standardised(features, self.mean, self.spread)
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            values = values @ weight
            values += bias
            np.maximum(values, LEAK * values, out=values)
        return np.asarray((values @ self.weights[-1] + self.biases[-1])[:, 0], dtype=np.float32)


def standardised(features: Values, mean: Values, spread: Values) -> Values:
    """(features - mean) / spread, clipped."""
    values = features - mean
    values /= spread
    return np.asarray(np.clip(values, -CLIPPED, CLIPPED, out=values), dtype=np.float32)


class Training:
    """The classifier while it learns: Adam (Kingma and Ba 2015) on the cross-entropy, with weight decay."""

    def __init__(self, mean: Values, spread: Values, steps: int, rng: np.random.Generator) -> None:
        sizes = (len(mean), *HIDDEN, 1)
        self._mean, self._spread, self._steps, self._step = mean, spread, steps, 0
        self._weights = [rng.normal(0, np.sqrt(2 / a), (a, b)).astype(np.float32) for a, b in pairwise(sizes)]
        self._biases = [np.zeros(b, dtype=np.float32) for b in sizes[1:]]
        parts = self._weights + self._biases
        self._moments = [np.zeros_like(part) for part in parts]
        self._squares = [np.zeros_like(part) for part in parts]

    def learn(self, inputs: Values, is_ball: Values) -> None:
        """Step once on a batch of standardised inputs (n, features) and their truths (n,), 0 or 1."""
        layers = [inputs]
        for weight, bias in zip(self._weights[:-1], self._biases[:-1], strict=True):
            sums = layers[-1] @ weight + bias
            layers.append(np.maximum(sums, LEAK * sums))
        log_odds = (layers[-1] @ self._weights[-1] + self._biases[-1])[:, 0]
        back = ((1 / (1 + np.exp(-np.clip(log_odds, -30, 30))) - is_ball) / np.float32(len(is_ball)))[:, None]
        slopes: list[Values] = []
        bias_slopes: list[Values] = []
        for number in reversed(range(len(self._weights))):
            slopes.insert(0, layers[number].T @ back + np.float32(DECAY) * self._weights[number])
            bias_slopes.insert(0, back.sum(axis=0))
            if number:
                back = (back @ self._weights[number].T) * np.where(layers[number] > 0, np.float32(1), LEAK)
        self._descend(slopes + bias_slopes)

    def _descend(self, slopes: Sequence[Values]) -> None:
        rate = FIRST_RATE * (1 - self._step / self._steps) + LAST_RATE
        self._step += 1
        parts = self._weights + self._biases
        for part, slope, mean, square in zip(parts, slopes, self._moments, self._squares, strict=True):
            np.add(MOMENT * mean, (1 - MOMENT) * slope, out=mean, casting="same_kind")
            np.add(SQUARE * square, (1 - SQUARE) * slope * slope, out=square, casting="same_kind")
            size = np.sqrt(square / (1 - SQUARE**self._step)) + 1e-8
            np.subtract(part, rate * mean / (1 - MOMENT**self._step) / size, out=part, casting="same_kind")

    def classifier(self) -> PatchClassifier:
        """Return the classifier learned so far."""
        copies = [[part.copy() for part in parts] for parts in (self._weights, self._biases)]
        return PatchClassifier(self._mean, self._spread, tuple(copies[0]), tuple(copies[1]))
