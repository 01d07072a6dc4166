"""Learn what one's own ball looks like from a few images with a box about it."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from kendama_cli.vision.ball_box import TaughtImage, refuse_boxes
from kendama_cli.vision.ball_patches import Patches, all_patches, median_radius_px
from kendama_cli.vision.patch_classifier import PatchClassifier, Training, Values, standardised
from kendama_cli.vision.patch_features import COUNT, DIRECTIONS, turned

CLASSIFIERS = 3
STEPS, ROUNDS = 1500, 3
BALLS_A_BATCH, OTHERS_A_BATCH = 96, 192
TURNED = 0.5
"""The part of the batches that are shown turned or mirrored, balls and others alike."""
HARD_AN_IMAGE = 300
HARD_LOG_ODDS = -2.0
CHECK_STEPS = 300
ODD_SHARE = 0.05
"""A box is refused when this part of its image looks more like the other boxes than the box does itself."""


@dataclass(frozen=True)
class TaughtBall:
    """The ball's radius in the images that taught it [px], and the classifiers that learned it."""

    radius_px: float
    classifiers: tuple[PatchClassifier, ...]

    def log_odds(self, features: Values) -> Values:
        """Log odds (n,) of patches with ``features`` (n, COUNT): the classifiers' mean less their standard deviation.

        On what none of the taught images resembles the classifiers differ: such patches are no sure sighting.
        """
        each = np.array([one.log_odds(features) for one in self.classifiers])
        return np.asarray(each.mean(axis=0) - each.std(axis=0), dtype=np.float32)

    def to_bytes(self) -> bytes:
        """The taught ball as an npz file; ``from_bytes`` takes it up again, exact to the last bit."""
        content: dict[str, NDArray[np.generic]] = {"radius_px": np.array(self.radius_px)}
        for number, one in enumerate(self.classifiers):
            content |= {f"{number}_mean": one.mean, f"{number}_spread": one.spread}
            for layer, (weight, bias) in enumerate(zip(one.weights, one.biases, strict=True)):
                content |= {f"{number}_weight_{layer}": weight, f"{number}_bias_{layer}": bias}
        file = io.BytesIO()
        np.savez(file, allow_pickle=False, **content)
        return file.getvalue()

    @staticmethod
    def from_bytes(content: bytes) -> TaughtBall:
        """Raises ValueError for what holds no taught ball."""
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                read = {name: np.asarray(file[name]) for name in file.files}
            numbers = sorted({name.split("_")[0] for name in read} - {"radius"})
            made = TaughtBall(
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
        except (KeyError, ValueError, TypeError, OSError, EOFError, BadZipFile) as wrong:
            raise ValueError(f"no taught ball ({wrong})") from None
        if not (made.classifiers and known and 0 < made.radius_px < 1e5):
            raise ValueError("no taught ball (its numbers are not finite)")
        return made


def teach(images: Sequence[TaughtImage], seed: int = 0) -> TaughtBall:
    """Learn the ball from ``images``: 3 to 10 with boxes are meant.

    Patches about the boxes' middles against patches elsewhere, at three scales; copies of the ball are blurred, turned
    and lit otherwise; what the classifier takes for the ball in these very images is learned again as not the ball
    (twice). Raises ValueError without a box, for a box of under 4 px or on a plain surface, and (from three images with
    boxes on) where a box shows something else than the others do.
    """
    refuse_boxes(images)
    rng = np.random.default_rng(seed)
    patches = all_patches(images, rng)
    for number, share in _odd(images, patches, rng):
        box = images[number].boxes[0]
        raise ValueError(
            f"the box at {box.u_px:.0f},{box.v_px:.0f} in image {number + 1} shows something else than the other "
            f"boxes: {share:.0%} of that image looks more like them"
        )
    return TaughtBall(median_radius_px(images), tuple(_train(patches, STEPS, ROUNDS, rng) for _ in range(CLASSIFIERS)))


def odd_images(images: Sequence[TaughtImage], seed: int = 0) -> dict[int, float]:
    """The images whose box ``teach`` would refuse for showing something else, with the part of each that looks more
    like the other boxes than its own does."""
    rng = np.random.default_rng(seed)
    return dict(_odd(images, all_patches(images, rng), rng))


def _odd(
    images: Sequence[TaughtImage], patches: Sequence[Patches], rng: np.random.Generator
) -> Iterator[tuple[int, float]]:
    """Images whose box is not found again by what the boxes of all others taught."""
    boxed = [number for number, image in enumerate(images) if image.boxes]
    if len(boxed) < 3:
        return
    for number in boxed:
        own = [one for one in patches if one.image == number and one.balls]
        others = [one for one in patches if one.image != number]
        if not own or not any(one.balls for one in others):
            continue
        classifier = _train(others, CHECK_STEPS, 1, rng)
        shares = []
        for one in own:
            best = max(float(classifier.log_odds(ball).max()) for ball in one.balls)
            shares.append(float((classifier.log_odds(one.elsewhere) > best).mean()))
        if min(shares) > ODD_SHARE:
            yield number, min(shares)


def _train(patches: Sequence[Patches], steps: int, rounds: int, rng: np.random.Generator) -> PatchClassifier:
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
    """The features of patches elsewhere that look most like the ball."""
    found = []
    for one in patches:
        log_odds = classifier.log_odds(one.elsewhere)
        worst = np.argsort(-log_odds)[:HARD_AN_IMAGE]
        found.append(one.elsewhere[worst[log_odds[worst] > HARD_LOG_ODDS]])
    return np.concatenate(found)
