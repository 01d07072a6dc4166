"""Learn what one's own ball looks like from a few images with a box about it."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from kendama_cli.vision.ball_box import LEAST_CONTRAST, BallBox, TaughtImage
from kendama_cli.vision.ball_copies import before, varied
from kendama_cli.vision.interface import Image
from kendama_cli.vision.patch_classifier import PatchClassifier, Training, Values, standardised
from kendama_cli.vision.patch_features import BALL_PX, COUNT, DIRECTIONS, patch_features, scaled, turned

SCALES = (0.75, 1.0, 1.33)
"""The ball is searched at its taught radius times these."""
CLASSIFIERS = 3
STEPS, ROUNDS = 1500, 3
BALLS_A_BATCH, OTHERS_A_BATCH = 96, 192
INSIDE, OUTSIDE = 0.35, 1.1
"""In half boxes: patches nearer to the box's middle show the ball, patches farther do not, the rest is left out."""
LIKE_RADIUS = (0.8, 1.25)
"""An image teaches the ball at a scale where its radius comes within this part of BALL_PX."""
VARIED = 6
"""Blurred and otherwise lit copies of each ball."""
ELSEWHERE = 6
"""Copies of each ball before what else the images show: with few boxes its own backgrounds would be learned with it."""
TRIES = 10
TURNED = 0.5
OTHERS_AN_IMAGE, OTHERS_A_COPY, HARD_AN_IMAGE = 1500, 60, 300
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


@dataclass(frozen=True)
class _Patches:
    """Features of patches in one image at one scale: those that show the ball, some others, and all that do not."""

    image: int
    balls: tuple[Values, ...]
    others: tuple[Values, ...]
    elsewhere: Values


def teach(images: Sequence[TaughtImage], seed: int = 0) -> TaughtBall:
    """Learn the ball from ``images``: 3 to 10 with boxes are meant.

    Patches about the boxes' middles against patches elsewhere, at three scales; copies of the ball are blurred, turned
    and lit otherwise; what the classifier takes for the ball in these very images is learned again as not the ball
    (twice). Raises ValueError without a box, for a box of under 4 px or on a plain surface, and (from three images with
    boxes on) where a box shows something else than the others do.
    """
    boxes = [box for image in images for box in image.boxes]
    if not boxes:
        raise ValueError(f"none of {len(images)} images has a box about the ball")
    small = min(boxes, key=lambda box: box.radius_px)
    if small.radius_px < 2:
        raise ValueError(f"a box of {small.width_px:.1f} x {small.height_px:.1f} px: a ball needs 4 px at the least")
    for number, image in enumerate(images):
        for box in image.boxes:
            if (stands_out := box.contrast(image.pixels)) < LEAST_CONTRAST:
                raise ValueError(
                    f"the box at {box.u_px:.0f},{box.v_px:.0f} in image {number + 1} shows a plain surface: contrast "
                    f"{stands_out:.1f} of 255, allowed: {LEAST_CONTRAST:g} and more"
                )
    rng = np.random.default_rng(seed)
    patches = _all_patches(images, rng)
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
    return dict(_odd(images, _all_patches(images, rng), rng))


def median_radius_px(images: Sequence[TaughtImage]) -> float:
    """Of the balls in the boxes."""
    return float(np.median([box.radius_px for image in images for box in image.boxes]))


def _all_patches(images: Sequence[TaughtImage], rng: np.random.Generator) -> list[_Patches]:
    radius_px = median_radius_px(images)
    found: list[_Patches] = []
    for scale in SCALES:
        views = [_view(number, image, BALL_PX / (radius_px * scale)) for number, image in enumerate(images)]
        found += [_collect(view, views, rng) for view in views]
    return found


def _odd(
    images: Sequence[TaughtImage], patches: Sequence[_Patches], rng: np.random.Generator
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


@dataclass(frozen=True)
class _View:
    """One image at one scale."""

    number: int
    pixels: Image
    away: tuple[tuple[float, NDArray[np.float64]], ...]
    """of each box its ball's radius [px] in ``pixels``, and every pixel's distance from its middle in half boxes"""
    outside: NDArray[np.bool_]
    """what shows no ball"""


def _view(number: int, image: TaughtImage, scale: float) -> _View:
    small = scaled(image.pixels, scale)
    rows, columns = np.mgrid[: small.shape[0], : small.shape[1]].astype(np.float64)
    away = [_half_boxes(columns, rows, box, scale) for box in image.boxes]
    outside = np.min(away, axis=0) > OUTSIDE if away else np.ones(small.shape[:2], dtype=np.bool_)
    radii = [box.radius_px * scale for box in image.boxes]
    return _View(number, small, tuple(zip(radii, away, strict=True)), outside)


def _collect(view: _View, views: Sequence[_View], rng: np.random.Generator) -> _Patches:
    """The patches of one image at one scale; ``views`` are all images at that scale."""
    features, outside = patch_features(view.pixels), view.outside
    balls: list[Values] = []
    others: list[Values] = []
    for radius_px, distance in view.away:
        inside = np.argwhere(distance < INSIDE)
        if len(inside) and LIKE_RADIUS[0] < radius_px / BALL_PX < LIKE_RADIUS[1]:
            balls.append(features[inside[:, 0], inside[:, 1]])
            copies, beside = _copies(view, distance, views, rng)
            balls.append(copies)
            others.append(beside)
    places = np.argwhere(outside)
    if len(places):
        some = places[rng.integers(0, len(places), OTHERS_AN_IMAGE)]
        others.append(features[some[:, 0], some[:, 1]])
    elsewhere = features[::2, ::2][outside[::2, ::2]]
    return _Patches(view.number, tuple(balls), tuple(others), elsewhere)


def _copies(
    view: _View, distance: NDArray[np.float64], views: Sequence[_View], rng: np.random.Generator
) -> tuple[Values, Values]:
    """Features of a ball's places, and of some places about them, in varied copies of the image about the ball."""
    reach, inside = round(7.5 * BALL_PX), np.argwhere(distance < INSIDE)
    (top, left), (bottom, right) = np.maximum(inside.min(axis=0) - reach, 0), inside.max(axis=0) + reach
    crop, near = view.pixels[top:bottom, left:right], distance[top:bottom, left:right]
    at = inside - (top, left)
    balls, others = [], [np.empty((0, COUNT), dtype=np.float32)]
    for number in range(VARIED + ELSEWHERE):
        background = _background(views, near.shape[0], near.shape[1], rng) if number >= VARIED else None
        if background is None:
            copy, is_free = varied(crop, rng), view.outside[top:bottom, left:right]
        else:
            copy, is_free = before(background, crop, near, rng), near > OUTSIDE
        features, free = patch_features(copy), np.argwhere(is_free)
        balls.append(features[at[:, 0], at[:, 1]])
        if len(free):
            some = free[rng.integers(0, len(free), OTHERS_A_COPY)]
            others.append(features[some[:, 0], some[:, 1]])
    return np.concatenate(balls), np.concatenate(others)


def _background(views: Sequence[_View], height: int, width: int, rng: np.random.Generator) -> Image | None:
    """A part (height, width, 3) of one of the images that shows no ball; None where none is found."""
    for _ in range(TRIES):
        view = views[int(rng.integers(len(views)))]
        down, right = view.outside.shape[0] - height, view.outside.shape[1] - width
        if min(down, right) < 0:
            continue
        row, column = int(rng.integers(down + 1)), int(rng.integers(right + 1))
        part = slice(row, row + height), slice(column, column + width)
        if view.outside[part].all():
            return view.pixels[part]
    return None


def _half_boxes(
    columns: NDArray[np.float64], rows: NDArray[np.float64], box: BallBox, scale: float
) -> NDArray[np.float64]:
    """Distance of each pixel of the scaled image from the box's middle, in half boxes."""
    u, v = (box.u_px + 0.5) * scale - 0.5, (box.v_px + 0.5) * scale - 0.5
    return np.hypot((columns - u) / (box.width_px * scale / 2), (rows - v) / (box.height_px * scale / 2))


def _train(patches: Sequence[_Patches], steps: int, rounds: int, rng: np.random.Generator) -> PatchClassifier:
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
            if rng.random() < TURNED:
                batch = batch[:, orders[rng.integers(len(orders))]]
            from_hard = OTHERS_A_BATCH // 2 if len(hard) else 0
            some = common[rng.integers(0, len(common), OTHERS_A_BATCH - from_hard)]
            most = hard[rng.integers(0, max(len(hard), 1), from_hard)]
            training.learn(np.concatenate([batch, some, most]), truth)
        if round_ < rounds - 1:
            hard = np.concatenate([hard, standardised(_hard(training.classifier(), patches), mean, spread)])
    return training.classifier()


def _hard(classifier: PatchClassifier, patches: Sequence[_Patches]) -> Values:
    """The features of patches elsewhere that look most like the ball."""
    found = []
    for one in patches:
        log_odds = classifier.log_odds(one.elsewhere)
        worst = np.argsort(-log_odds)[:HARD_AN_IMAGE]
        found.append(one.elsewhere[worst[log_odds[worst] > HARD_LOG_ODDS]])
    return np.concatenate(found)
