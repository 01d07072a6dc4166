"""Learn what one's own ball looks like from a few images with a box about it."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.plugins.films.ball_box import TrainedImage, refuse_boxes
from kendama_cli.plugins.films.ball_patches import all_patches, median_radius_px
from kendama_cli.plugins.films.box_similarity import refuse_unlike
from kendama_cli.plugins.films.patch_classifier import PatchClassifier, Values
from kendama_cli.plugins.films.patch_features import COUNT
from kendama_cli.plugins.films.patch_training import trained
from kendama_cli.schema.unpacking import unpacked_arrays

CLASSIFIERS = 3
STEPS, ROUNDS = 1500, 3
UNLIKELY = -15.0
"""Log odds from which the mean of three could be a peak only if the two others had more than 30."""
MOST_BYTES = 1 << 26
"""Limit of all arrays of a trained ball; ours have some hundred kB."""


@dataclass(frozen=True)
class TrainedBall:
    """The ball's radius in the images that taught it [px], and the classifiers that learned it."""

    radius_px: float
    classifiers: tuple[PatchClassifier, ...]

    def log_odds(self, features: Values) -> Values:
        """Log odds (n,) of patches with ``features`` (n, COUNT): the classifiers' mean less their standard deviation.

        On what none of the training images resembles the classifiers differ: such patches are no sure sighting. What
        is below UNLIKELY for the first one the others are not asked about.
        """
        log_odds = self.classifiers[0].log_odds(features)
        asked = np.flatnonzero(log_odds > UNLIKELY)
        each = np.array([log_odds[asked], *(one.log_odds(features[asked]) for one in self.classifiers[1:])])
        log_odds[asked] = each.mean(axis=0) - each.std(axis=0)
        return log_odds

    def to_bytes(self) -> bytes:
        """Return the trained ball as an npz file; ``from_bytes`` takes it up again, exact to the last bit."""
        content: dict[str, NDArray[np.generic]] = {"radius_px": np.array(self.radius_px)}
        for number, one in enumerate(self.classifiers):
            content |= {f"{number}_mean": one.mean, f"{number}_spread": one.spread}
            for layer, (weight, bias) in enumerate(zip(one.weights, one.biases, strict=True)):
                content |= {f"{number}_weight_{layer}": weight, f"{number}_bias_{layer}": bias}
        file = io.BytesIO()
        np.savez(file, allow_pickle=False, **content)
        return file.getvalue()

    @staticmethod
    def from_bytes(content: bytes) -> TrainedBall:
        """Raises ValueError for what holds no trained ball."""
        try:
            read = unpacked_arrays(content, MOST_BYTES)
            numbers = sorted({name.split("_")[0] for name in read} - {"radius"})
            made = TrainedBall(
                float(read["radius_px"]),
                tuple(
                    PatchClassifier(
                        read[f"{number}_mean"],
                        read[f"{number}_spread"],
                        tuple(read[f"{number}_weight_{layer}"] for layer in range(3)),
                        tuple(read[f"{number}_bias_{layer}"] for layer in range(3)),
                    )
                    for number in numbers
                ),
            )
            known = all(np.isfinite(made.log_odds(np.zeros((1, COUNT), dtype=np.float32))))
        except (KeyError, ValueError, TypeError, OverflowError) as wrong:
            raise ValueError(f"no trained ball ({wrong})") from None
        if not (made.classifiers and known and 0 < made.radius_px < 1e5):
            raise ValueError("no trained ball (its numbers are not finite)")
        return made


def teach(images: Sequence[TrainedImage], seed: int = 0) -> TrainedBall:
    """Learn the ball from ``images``: 3 to 10 with boxes are meant.

    Patches about the boxes' middles against patches elsewhere, at three scales; copies of the ball are blurred, turned
    and lit otherwise; what the classifier takes for the ball in these very images is learned again as not the ball
    (twice). Raises ValueError for no box, for one that is too small or too large or on a plain surface, and (from three
    images with boxes on) where a box shows something else than the others do, or none shows what others do.
    """
    refuse_boxes(images)
    rng = np.random.default_rng(seed)
    patches = all_patches(images, rng)
    refuse_unlike(images, patches, rng)
    classifiers = tuple(trained(patches, STEPS, ROUNDS, rng) for _ in range(CLASSIFIERS))
    return TrainedBall(median_radius_px(images), classifiers)
