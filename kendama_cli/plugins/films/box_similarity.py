"""Test that the boxes of training images show one thing, and one that the images do not show all over."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kendama_cli.plugins.films.ball_box import FEWEST_BOXES, TrainedImage
from kendama_cli.plugins.films.ball_patches import Patches
from kendama_cli.plugins.films.training import trained

CHECK_STEPS = 300
ODD_SHARE = 0.05
"""A box is refused when this part of its image looks more like the other boxes than the box and its copies do."""
UNLIKE_SHARE = 0.03
"""All boxes are refused when more than this part of the images, in the geometric mean, looks more like the other boxes
than an image's own does: on two phone films 0.0001 to 0.004 for boxes about balls, 0.008 to 0.9 for boxes
elsewhere."""
LEAST_SHARE = 1e-4
"""Less is not told apart: an image has some ten thousand places."""


def refuse_unlike(images: Sequence[TrainedImage], patches: Sequence[Patches], rng: np.random.Generator) -> None:
    """Raise ValueError if a box shows something else than the others do, or all have nothing in common.

    A classifier learns the boxes of all images but one, and looks at that one: which part of it looks more like those
    boxes than its own box does, as it is (``unlike``) and with all copies of it (``odd``, the least of all scales). Of
    boxes anywhere each part is uniform in 0..1, and the geometric mean is that of Fisher's test of them all together.
    Fewer than FEWEST_BOXES are not compared.
    """
    boxed = [number for number, image in enumerate(images) if image.boxes]
    unlike = []
    for number in boxed if len(boxed) >= FEWEST_BOXES else ():
        own = [one for one in patches if one.image == number]
        others = [one for one in patches if one.image != number]
        if not any(one.balls for one in own) or not any(one.balls for one in others):
            continue
        classifier = trained(others, CHECK_STEPS, 1, rng)
        elsewhere = [classifier.log_odds(one.elsewhere) for one in own]
        best = [max((float(classifier.log_odds(ball).max()) for ball in one.balls), default=np.inf) for one in own]
        odd = min(float((some > most).mean()) for some, most in zip(elsewhere, best, strict=True) if most < np.inf)
        if odd > ODD_SHARE:
            box = images[number].boxes[0]
            raise ValueError(
                f"the box at {box.u_px:.0f},{box.v_px:.0f} in image {number + 1} shows something else than the other "
                f"boxes: {odd:.0%} of that image looks more like them"
            )
        uncopied = max(float(classifier.log_odds(ball).max()) for one in own for ball in one.uncopied)
        unlike.append(float((np.concatenate(elsewhere) > uncopied).mean()))
    if unlike and (share := float(np.exp(np.mean(np.log(np.maximum(unlike, LEAST_SHARE)))))) > UNLIKE_SHARE:
        raise ValueError(
            f"the {sum(len(image.boxes) for image in images)} boxes do not show one ball: {share:.1%} of their images "
            f"looks more like the other boxes than each of them does, allowed: {UNLIKE_SHARE:.0%}"
        )
