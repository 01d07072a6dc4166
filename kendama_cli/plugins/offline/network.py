"""A black-box network of the ball's motion: two hidden layers of tanh, trained by Adam on single transitions.

It predicts the change of the ball's position and velocity relative to the tie over one step, from that state and the
cup's acceleration and velocity; it knows neither rope nor gravity. Adam: D. Kingma and J. Ba, ICLR 2015.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from kendama_cli.plugins.offline.settings import FitSettings
from kendama_cli.schema.arrays import Array

INPUTS = 6
"""Ball's x, z and their rates relative to the tie; the cup's acceleration and velocity."""
DECAYS = 0.9, 0.999
"""Adam's decay rates of the mean gradient and of its mean square."""
TINY = 1e-8


@dataclass(frozen=True)
class Network:
    """Layers (inputs + 1, outputs), with biases in the last row, and the ``scale`` (2, 10) of inputs and outputs."""

    layers: tuple[Array, ...]
    scale: Array

    def changes(self, inputs: Array) -> Array:
        """Return the predicted changes (n, 4) of the ball's state for ``inputs`` (n, 6)."""
        mean, deviation = self.scale
        hidden = (inputs - mean[:INPUTS]) / deviation[:INPUTS]
        for layer in self.layers[:-1]:
            hidden = np.tanh(hidden @ layer[:-1] + layer[-1])
        last = self.layers[-1]
        return np.asarray(mean[INPUTS:] + deviation[INPUTS:] * (hidden @ last[:-1] + last[-1]))


def trained(inputs: Array, changes: Array, settings: FitSettings, rng: Generator) -> Network:
    """Return a network fitted to ``changes`` (n, 4) after ``inputs`` (n, 6) by least squares of the scaled errors."""
    both = np.column_stack([inputs, changes])
    scale = np.stack([both.mean(axis=0), both.std(axis=0)])
    x, y = np.split((both - scale[0]) / scale[1], [INPUTS], axis=1)
    sizes = INPUTS, settings.hidden, settings.hidden, y.shape[1]
    layers = [
        np.vstack([rng.standard_normal((n, m)) / math.sqrt(n), np.zeros(m)]) for n, m in itertools.pairwise(sizes)
    ]
    means, squares = [np.zeros_like(one) for one in layers], [np.zeros_like(one) for one in layers]
    for update in range(1, settings.updates + 1):
        rows = rng.integers(len(x), size=settings.batch)
        rate = settings.learning_rate * 0.5 * (1.0 + math.cos(math.pi * update / settings.updates))
        for i, slope in enumerate(_slopes(layers, x[rows], y[rows])):
            means[i] += (1.0 - DECAYS[0]) * (slope - means[i])
            squares[i] += (1.0 - DECAYS[1]) * (slope * slope - squares[i])
            step, spread = means[i] / (1.0 - DECAYS[0] ** update), squares[i] / (1.0 - DECAYS[1] ** update)
            layers[i] -= rate * step / (np.sqrt(spread) + TINY)
    return Network(tuple(layers), scale)


def _slopes(layers: list[Array], x: Array, y: Array) -> list[Array]:
    """Return the gradients of half the mean squared error, by back-propagation."""
    outputs = [x]
    for i, layer in enumerate(layers):
        following = outputs[-1] @ layer[:-1] + layer[-1]
        outputs.append(following if i == len(layers) - 1 else np.tanh(following))
    error, slopes = (outputs[-1] - y) / len(x), []
    for i in reversed(range(len(layers))):
        slopes.append(np.vstack([outputs[i].T @ error, error.sum(axis=0)]))
        if i:
            error = (error @ layers[i][:-1].T) * (1.0 - outputs[i] ** 2)
    return slopes[::-1]
