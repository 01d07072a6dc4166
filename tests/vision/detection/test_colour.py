"""Masks pixel by pixel by Python's own colours, and the patches of a drawn image."""

import colorsys
import dataclasses

import numpy as np
import pytest

from kendama_cli.vision.detection.colour import HUES, SATURATIONS, HsvThresholds, LearnedColour
from kendama_cli.vision.detection.colour_detector import ColourDetector
from tests.vision.scenes import predict


def _hsv(pixel):
    """Hue of 0 to 179 and saturation and value of 0 to 255, not rounded."""
    blue, green, red = (int(one) / 255 for one in pixel)
    hue, saturation, value = colorsys.rgb_to_hsv(red, green, blue)
    return np.array([hue * 180, saturation * 255, value * 255])


@pytest.mark.parametrize(("low", "high"), [(20, 70), (160, 15)])
def test_thresholds_hold_a_range_of_hue_that_may_run_through_red_and_least_saturation_and_value(low, high):
    pixels = np.random.default_rng(1).integers(0, 256, (60, 60, 3)).astype(np.uint8)
    settings = dataclasses.replace(predict().detector, hue_low=low, hue_high=high, saturation_min=90, value_min=120)
    mask, seen = HsvThresholds(settings).mask(pixels), 0
    for at in np.ndindex(60, 60):
        hue, saturation, value = _hsv(pixels[at])
        edges = [abs(hue - low), abs(hue - high), abs(saturation - 90), abs(value - 120), abs(hue - 180), hue]
        if min(edges) > 1.5:  # OpenCV rounds
            inside = (low < hue < high if low < high else hue > low or hue < high) and saturation > 90 and value > 120
            seen += inside
            assert mask[at] == (255 if inside else 0)
    assert seen > 100


def test_a_learned_table_is_looked_up_by_hue_and_saturation_where_it_is_bright_enough():
    rng = np.random.default_rng(2)
    pixels = rng.integers(0, 256, (60, 60, 3)).astype(np.uint8)
    odds = rng.normal(size=(HUES, SATURATIONS))
    mask, seen = LearnedColour(odds, 100).mask(pixels), 0
    for at in np.ndindex(60, 60):
        hue, saturation, value = _hsv(pixels[at])
        parts = hue / 6, saturation / 16  # 30 hues of 6, 16 saturations of 16
        if min(abs(one - round(one)) for one in parts) > 0.2 and abs(value - 100) > 1:
            seen += 1
            assert mask[at] == (255 if odds[int(parts[0]), int(parts[1])] > 0 and value > 100 else 0)
    assert seen > 500


@pytest.mark.parametrize("size", [(100, 140), (300, 400)])
def test_patches_are_the_three_largest_of_the_colour_that_are_not_too_small_the_nearest_first_if_one_is_expected(size):
    """Every second pixel of a large image is looked at."""
    detector = ColourDetector(dataclasses.replace(predict().detector, min_radius_px=4.0))
    rows, columns = np.mgrid[: size[0], : size[1]]
    image = np.full((*size, 3), 90, np.uint8)
    discs = [(30, 30, 12), (80, 30, 9), (115, 70, 7), (30, 80, 6), (80, 85, 2)]
    for u, v, radius in discs:
        image[np.hypot(columns - u, rows - v) < radius] = (20, 20, 200)
    found = detector._patches(image, None)
    assert [(one.centre[0], one.centre[1], one.radius) for one in found] == [
        pytest.approx(row, abs=1.6) for row in discs[:3]
    ]
    near = detector._patches(image, np.array([110.0, 60.0]))
    assert [one.centre[0] for one in near] == pytest.approx([115, 80, 30], abs=1.6)
    few = np.full((*size, 3), 90, np.uint8)
    few[np.hypot(columns - 50, rows - 50) < 2.5] = (20, 20, 200)
    assert detector._patches(few, None) == []
