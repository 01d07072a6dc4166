"""The circle through an outline on drawn discs whose centre, radius and noise are known."""

import numpy as np
import pytest

from kendama_cli.vision.detection import colour_detector
from kendama_cli.vision.detection.colour_detector import DIRECTIONS, RAYS, CircleFit, Disc

FIT = CircleFit(min_radius_px=3.0, min_outline=0.4, sigma_floor_px=0.01)
FINE = (np.arange(8) + 0.5) / 8 - 0.5


def drawn(center, radius, shade=0.0):
    """An image (80, 100, 3) of an even disc before another colour, each pixel the mean of 64 points of it."""
    y, x = np.arange(80)[:, None] + FINE, np.arange(100)[:, None] + FINE
    inside = np.hypot(x[None, :, None, :] - center[0], y[:, None, :, None] - center[1]) < radius
    part = inside.mean(axis=(2, 3))[..., None]
    light = 1 + shade * (np.arange(100)[None, :, None] / 100 - 0.5)
    return light * (part * [40.0, 60.0, 200.0] + (1 - part) * [90.0, 110.0, 60.0])


@pytest.mark.parametrize("shade", [0.0, 0.5])
def test_a_disc_s_centre_and_radius_are_found_from_a_rough_place_and_its_whole_outline_counts(shade):
    rng = np.random.default_rng(1)
    for radius in (5.0, 9.3, 16.0):
        center = np.array([50.0, 40.0]) + rng.uniform(-1, 1, 2)
        image = np.clip(drawn(center, radius, shade), 0, 255).round().astype(np.uint8)
        found = FIT.circle(image, Disc(center + rng.uniform(-0.2, 0.2, 2) * radius, radius * rng.uniform(0.85, 1.15)))
        assert found.centre_px == pytest.approx(center, abs=0.03)
        assert found.radius_px == pytest.approx(radius, abs=0.12)
        assert found.score > 0.95
    assert FIT.circle(image, Disc(np.array([10.0, 10.0]), 9.0)) is None, "there is no disc"
    assert FIT.circle(image, Disc(np.array([-90.0, 10.0]), 9.0)) is None, "outside the image"
    small = np.clip(drawn((50.0, 40.0), 2.5), 0, 255).round().astype(np.uint8)
    assert FIT.circle(small, Disc(np.array([50.0, 40.0]), 2.5)) is None


def test_its_covariance_is_that_of_the_errors_with_and_without_a_part_that_is_hidden():
    """Mean of 120 normalised squares of two numbers; measured 3.9 and 3.3, as neighbouring rays share pixels."""
    rng = np.random.default_rng(2)
    for hidden in (0, 12):
        squares, scores = [], []
        for draw in range(120):
            if draw % 40 == 0:
                center = np.array([50.0, 40.0]) + rng.uniform(-1, 1, 2)
                image = drawn(center, 14.0)
                image[:, : int(center[0]) - 14 + hidden // 2] = [90.0, 110.0, 60.0]
            noisy = np.clip(image + 12 * rng.standard_normal(image.shape), 0, 255).round().astype(np.uint8)
            found = FIT.circle(noisy, Disc(center + rng.uniform(-1, 1, 2), 14.0))
            error = found.centre_px - center
            squares.append(error @ np.linalg.solve(found.covariance_px2, error))
            scores.append(found.score)
        assert 2.2 < np.mean(squares) < 5.5
        assert (np.mean(scores) > 0.95) == (hidden == 0)
    assert 0.5 < np.mean(scores) < 0.85


def test_the_least_sigma_adds_to_the_covariance_and_few_rays_are_enough_where_that_is_set():
    image = np.clip(drawn((50.2, 40.4), 11.0), 0, 255).round().astype(np.uint8)
    bare, floored = (
        CircleFit(min_radius_px=3.0, min_outline=0.02, sigma_floor_px=sigma).circle(
            image, Disc(np.array([50.0, 40.0]), 11.0)
        )
        for sigma in (0.0, 0.5)
    )
    assert floored.covariance_px2 - bare.covariance_px2 == pytest.approx(0.25 * np.eye(2), abs=1e-12)
    rays = np.zeros(DIRECTIONS, bool)
    rays[::8] = True
    for least, seen in ((0.02, True), (0.2, False)):
        fit = CircleFit(min_radius_px=3.0, min_outline=least, sigma_floor_px=0.0)
        found = fit._fit(Disc(np.array([50.0, 40.0]), 11.0), np.full(DIRECTIONS, 11.0) + RAYS @ [0.2, -0.1], rays)
        assert (found is not None) == seen
        if found is not None:
            assert (*found.centre_px, found.radius_px) == pytest.approx((50.2, 39.9, 11.0))
            assert found.score == 6 / DIRECTIONS


def test_a_circle_through_given_points_is_least_squares_with_its_covariance():
    rng, every = np.random.default_rng(4), np.ones(DIRECTIONS, bool)
    reach = 11.0 + RAYS @ [0.2, -0.1] + 0.05 * rng.standard_normal(DIRECTIONS)
    found = FIT._fit(Disc(np.array([50.0, 40.0]), 11.0), reach, every)
    design = np.column_stack([RAYS, np.ones(DIRECTIONS)])
    circle, square, _, _ = np.linalg.lstsq(design, reach, rcond=None)
    covariance = np.linalg.inv(design.T @ design)[:2, :2] * square / (DIRECTIONS - 3) + 0.01**2 * np.eye(2)
    assert (*found.centre_px - [50.0, 40.0], found.radius_px) == pytest.approx(circle)
    assert found.covariance_px2 == pytest.approx(covariance, abs=1e-12)


def test_rays_read_the_image_between_its_pixels_and_those_that_leave_it_are_told():
    """An image whose colours are its columns and rows reads as the rays' own points."""
    y, x = np.mgrid[:80, :100]
    image = np.stack([x, y, x + y], axis=2).astype(np.uint8)
    for center, radius in (((50.3, 40.6), 8.0), ((12.2, 60.0), 9.0), ((88.0, 12.5), 6.0)):
        steps, profile, usable = colour_detector._profile_along_rays(image, Disc(np.array(center), radius))
        assert (steps[0], steps[1] - steps[0]) == (0.5 * radius, 0.5)
        assert 1.35 * radius + 3.0 <= steps[-1] < 1.35 * radius + 3.5 + 1e-9
        points = np.array(center) + RAYS[:, None] * steps[:, None]
        ends = points[:, -1]
        inside = ((ends >= 0) & (ends <= [99, 79])).all(axis=1)
        assert (usable == inside).all()
        expected = np.concatenate([points, points.sum(axis=2, keepdims=True)], axis=2)
        left = (profile - expected)[inside]  # whole grey levels
        assert np.abs(left).max() < 0.6
        assert np.abs(left.mean(axis=(0, 1))).max() < 0.05


def test_an_outline_is_where_the_signal_first_falls_through_its_level():
    steps = 4.0 + 0.5 * np.arange(20)
    at = np.random.default_rng(3).uniform(5.0, 12.0, DIRECTIONS)
    signal = 10.0 - 3.0 * (steps - at[:, None])
    found, seen = colour_detector._falls(steps, signal, np.full(DIRECTIONS, 10.0), np.arange(DIRECTIONS) % 5 > 0)
    assert (seen == (np.arange(DIRECTIONS) % 5 > 0)).all()
    assert found[seen] == pytest.approx(at[seen])
    rising, none = colour_detector._falls(steps, -signal, np.full(DIRECTIONS, -10.0), np.ones(DIRECTIONS, bool))
    assert not none.any()
    assert len(rising) == DIRECTIONS
