"""Result of fit: rope and drag as identified, and a network of the ball's motion, from the same data."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.arrays import Array, array


@dataclass(frozen=True)
class FittedModels:
    """Constants of a rope in air, and the layers of a network.

    ``hanging_m`` is the median distance of the ball from the tie. A layer (inputs + 1, outputs) has its biases in the
    last row; ``scale`` (2, 10) holds mean and standard deviation of six inputs and four outputs, ``bounds`` (2, 4) the
    least and the largest value of each state of the ball in the data.
    """

    rope_m: float
    linear_n_s_m: float
    quadratic_n_s2_m2: float
    hanging_m: float
    first: Array
    second: Array
    third: Array
    scale: Array
    bounds: Array

    def __post_init__(self) -> None:
        shapes = {"first": (7, None), "second": (None, None), "third": (None, 4), "scale": (2, 10), "bounds": (2, 4)}
        for name, shape in shapes.items():
            object.__setattr__(self, name, array(name, getattr(self, name), shape))
