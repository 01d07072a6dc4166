"""Test that the boxes of training images show one thing, and one that the images do not show all over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.plugins.films.ball_box import FEWEST_BOXES, TrainedImage
from kendama_cli.plugins.films.ball_patches import Patches, all_patches
from kendama_cli.plugins.films.patch_training import trained

CHECK_STEPS = 300
ODD_SHARE = 0.05
"""A box is refused when this part of its image looks more like the other boxes than the box and its copies do."""
UNLIKE_SHARE = 0.03
"""All boxes are refused when more than this part of the images, in the geometric mean, looks more like the other boxes
than an image's own does: on two phone films 0.0001 to 0.004 for boxes about balls, 0.008 to 0.9 for boxes
elsewhere."""
LEAST_SHARE = 1e-4
"""Less is not told apart: an image has some ten thousand places."""


@dataclass(frozen=True)
class BoxSimilarity:
    """Similarity of one image to the boxes of all others.

    It is the part of the image that looks more like them than its own box and all copies of that do (the least of
    all
    scales), and than its own box as it is does.
    """

    image: int
    share: float
    share_uncopied: float


def compared(
    images: Sequence[TrainedImage], patches: Sequence[Patches], rng: np.random.Generator
) -> list[BoxSimilarity]:
    """Compare each of ``images`` that has boxes with those of the others; nothing for under FEWEST_BOXES."""
    boxed = [number for number, image in enumerate(images) if image.boxes]
    if len(boxed) < FEWEST_BOXES:
        return []
    found = []
    for number in boxed:
        of_image = [one for one in patches if one.image == number]
        own = [one for one in of_image if one.balls]
        others = [one for one in patches if one.image != number]
        if not own or not any(one.balls for one in others):
            continue
        classifier = trained(others, CHECK_STEPS, 1, rng)
        elsewhere = {id(one): classifier.log_odds(one.elsewhere) for one in of_image}
        best = [max(float(classifier.log_odds(ball).max()) for ball in one.balls) for one in own]
        share = min(float((elsewhere[id(one)] > most).mean()) for one, most in zip(own, best, strict=True))
        uncopied = max(float(classifier.log_odds(ball).max()) for one in own for ball in one.uncopied)
        everywhere = np.concatenate(list(elsewhere.values()))
        found.append(BoxSimilarity(number, share, float((everywhere > uncopied).mean())))
    return found


def odd_boxes(similarity: Sequence[BoxSimilarity]) -> dict[int, float]:
    """Return the images whose box shows something else than the others, with the fraction that says so."""
    return {one.image: one.share for one in similarity if one.share > ODD_SHARE}


def unlike_share(similarity: Sequence[BoxSimilarity]) -> float:
    """Return the geometric mean over the images of the part that looks more like the other boxes than the own box
    does.

    Above UNLIKE_SHARE the boxes have nothing in common that tells them from the rest; 0 if nothing was compared. Of
    boxes
    anywhere each part is uniform in 0..1, and the mean is that of Fisher's test of them all together.
    """
    if not similarity:
        return 0.0
    return float(np.exp(np.mean(np.log([max(one.share_uncopied, LEAST_SHARE) for one in similarity]))))


def odd_images(images: Sequence[TrainedImage], seed: int = 0) -> dict[int, float]:
    """Return the images whose box training would refuse for showing something else.

    Each has the part that looks more like the other boxes than its own does; all of them if the boxes have nothing
    in
    common.
    """
    rng = np.random.default_rng(seed)
    similarity = compared(images, all_patches(images, rng), rng)
    odd = odd_boxes(similarity)
    if odd or unlike_share(similarity) <= UNLIKE_SHARE:
        return odd
    return {one.image: one.share_uncopied for one in similarity}
