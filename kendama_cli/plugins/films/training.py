"""Learn what one's own ball looks like from a few images with a box about it."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.plugins.films.ball_box import FEWEST_BOXES, TrainedImage, refuse_boxes
from kendama_cli.plugins.films.ball_patches import Patches, all_patches, median_radius_px
from kendama_cli.plugins.films.patches import COUNT, DIRECTIONS, PatchClassifier, Training, Values, standardised, turned
from kendama_cli.schema.unpacking import unpacked_arrays

CHECK_STEPS = 300
ODD_SHARE = 0.05
"""A box is refused when this part of its image looks more like the other boxes than the box and its copies do."""
UNLIKE_SHARE = 0.03
"""All boxes are refused when more than this part of the images, in the geometric mean, looks more like the other boxes
than an image's own does: on two phone films 0.0001 to 0.004 for boxes about balls, 0.008 to 0.9 for boxes
elsewhere."""
LEAST_SHARE = 1e-4
"""Less is not told apart: an image has some ten thousand places."""
BALLS_A_BATCH, OTHERS_A_BATCH = 96, 192
TURNED = 0.5
"""The part of the batches that are shown turned or mirrored, balls and others alike."""
HARD_AN_IMAGE = 300
HARD_LOG_ODDS = -2.0
CLASSIFIERS = 3
STEPS, ROUNDS = 1500, 3
UNLIKELY = -15.0
"""Log odds from which the mean of three could be a peak only if the two others had more than 30."""
MOST_BYTES = 1 << 26
"""Limit of all arrays of a trained ball; ours have some hundred kB."""


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


def trained(patches: Sequence[Patches], steps: int, rounds: int, rng: np.random.Generator) -> PatchClassifier:
    """Train a classifier by ``steps`` steps on ``patches``, of which some must show the ball.

    Between the ``rounds``, what the classifier takes for the ball elsewhere in these very images is added to what it
    learns as not the ball.
    """
    balls = np.concatenate([ball for one in patches for ball in one.balls])
    others = np.concatenate([other for one in patches for other in one.others])
    sample = np.concatenate([balls[:: max(len(balls) // 10_000, 1)], others])
    mean, spread = sample.mean(axis=0), sample.std(axis=0) + np.float32(1e-3)
    training = Training(mean, spread, steps, rng)
    shown, common = standardised(balls, mean, spread), standardised(others, mean, spread)
    hard = np.empty((0, COUNT), dtype=np.float32)
    orders = [turned(eighths, mirrored=mirrored) for eighths in range(DIRECTIONS) for mirrored in (False, True)]
    truth = np.repeat(np.array([1, 0], dtype=np.float32), [BALLS_A_BATCH, OTHERS_A_BATCH])
    for round_ in range(rounds):
        for _ in range(steps // rounds):
            batch = shown[rng.integers(0, len(shown), BALLS_A_BATCH)]
            from_hard = OTHERS_A_BATCH // 2 if len(hard) else 0
            some = common[rng.integers(0, len(common), OTHERS_A_BATCH - from_hard)]
            most = hard[rng.integers(0, max(len(hard), 1), from_hard)]
            batch = np.concatenate([batch, some, most])
            if rng.random() < TURNED:  # balls and others alike: else what is turned would be the ball
                batch = batch[:, orders[rng.integers(len(orders))]]
            training.learn(batch, truth)
        if round_ < rounds - 1:
            hard = np.concatenate([hard, standardised(_hard(training.classifier(), patches), mean, spread)])
    return training.classifier()


def _hard(classifier: PatchClassifier, patches: Sequence[Patches]) -> Values:
    """Return the features of patches elsewhere that look most like the ball."""
    found = []
    for one in patches:
        log_odds = classifier.log_odds(one.elsewhere)
        worst = np.argsort(-log_odds)[:HARD_AN_IMAGE]
        found.append(one.elsewhere[worst[log_odds[worst] > HARD_LOG_ODDS]])
    return np.concatenate(found)


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
