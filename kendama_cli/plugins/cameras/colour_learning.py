"""Colour of a ball, learned from pixels that a person has pointed at: the work of ``camera colour``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from kendama_cli.cli import render
from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.errors import InputError, UsageError
from kendama_cli.plugins.shared.videos.views import cameras_of, read_views
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.colour import HUE_STEP, HUES, SATURATION_STEP, SATURATIONS, LearnedColour
from kendama_cli.vision.detection.interface import Image

RARE = 1e-4
"""A colour that was seen nowhere is taken to make up so much of ball and surroundings alike."""
DARK_PART = 0.25
"""Pixels darker than this part of the darkest ball pixels have no usable colour."""


def learn_colour(ball: Image, around: Image) -> LearnedColour:
    """Learn the ball's colour from pixels of the ball (n, 3) and of everything else (m, 3), blue, green, red.

    Bayes' rule on histograms of hue and saturation, blurred by one bin (hue goes round). Raises ValueError without
    pixels of both kinds, and for a ball without a colour of its own: fewer than half of its pixels would be known.
    """
    if len(ball) == 0 or len(around) == 0:
        raise ValueError(f"{len(ball)} pixels of the ball and {len(around)} of what is around it; give some of both")
    hsv = _hsv(ball)
    value_min = max(1, int(DARK_PART * float(np.quantile(hsv[:, 2], 0.1))))
    odds = np.log(_histogram(hsv) + RARE) - np.log(_histogram(_hsv(around)) + RARE)
    model = LearnedColour(odds, value_min)
    known = float((model.mask(ball[None]) > 0).mean())
    if known < 0.5:
        raise ValueError(f"only {known:.0%} of the ball's pixels differ in colour from what is around it")
    return model


def learn_from_clicks(images: Sequence[Image], clicks: Sequence[Sequence[float]], radius_px: float) -> LearnedColour:
    """Learn from one click (u, v) on the ball per image, with the ball's radius; what lies two radii off is not ball.

    Only the inner part of the disc is used, for blur mixes its rim with the surroundings.
    """
    ball, around = [], []
    for image, (u, v) in zip(images, clicks, strict=True):
        rows, columns = np.mgrid[: image.shape[0], : image.shape[1]]
        distance = np.hypot(columns - u, rows - v)
        ball.append(image[distance <= 0.7 * radius_px])
        around.append(image[distance >= 2 * radius_px])
    return learn_colour(np.concatenate(ball), np.concatenate(around))


def _hsv(pixels: Image) -> Image:
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels)[None], cv2.COLOR_BGR2HSV)[0], dtype=np.uint8)


def _histogram(hsv: Image) -> Array:
    counts = np.zeros((HUES, SATURATIONS))
    np.add.at(counts, (hsv[:, 0] // HUE_STEP, hsv[:, 1] // SATURATION_STEP), 1.0)
    counts = (np.roll(counts, 1, axis=0) + 2 * counts + np.roll(counts, -1, axis=0)) / 4
    wide = np.pad(counts, ((0, 0), (1, 1)), mode="edge")
    counts = (wide[:, :-2] + 2 * wide[:, 1:-1] + wide[:, 2:]) / 4
    return np.asarray(counts / counts.sum())


def learn_ball(clicks: Sequence[str], radius_px: float, output: Path) -> None:
    """Learn the ball's colour where ``clicks``, IMAGE@U,V each, point at it, and write it.

    Raises UsageError for a click that is none or lies outside its image, InputError where nothing can be learned.
    """
    refuse_output(output, "a learned colour is JSON", ".json")
    images, places = [], []
    for click in clicks:
        name, _, place = click.rpartition("@")
        try:
            u, v = (float(part) for part in place.split(","))
        except ValueError:
            raise UsageError(f"{click}: give an image and the ball's middle in it, such as left.png@320,200") from None
        (_, pixels), *_ = read_views([path for paths in cameras_of([Path(name)]).values() for path in paths])
        if not (0 <= u < pixels.shape[1] and 0 <= v < pixels.shape[0]):
            size = f"{pixels.shape[1]} x {pixels.shape[0]} px"
            raise UsageError(f"{click}: the place lies outside the image of {size}; u counts columns, v rows")
        images.append(pixels)
        places.append((u, v))
    try:
        learned = learn_from_clicks(images, places, radius_px)
    except ValueError as error:
        raise InputError(", ".join(clicks), str(error), remedy="point at the ball in a well lit image") from None
    write_output(output, learned.to_json().encode())
    render.text(f"{output}; use it with predict.detector.colour={output}")
