"""Whether a camera stood still, told from films of a textured scene; made on seeds 10330 to 10335."""

import cv2
import numpy as np
import pytest

from kendama_cli.vision.camera_shift import STANDING_PX, camera_shift
from tests.vision.ball_films import HEIGHT, WIDTH, pendulum, textured

IMAGES = 21
SEEDS = [20330, 20331, 20332]


def moved(frames, places):
    """The frames as a camera sees them that is off by ``places`` (n, 2) [px]."""
    made = []
    for frame, (right, down) in zip(frames, places, strict=True):
        way = np.array([[1, 0, right], [0, 1, down]], dtype=np.float64)
        made.append(cv2.warpAffine(frame, way, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REFLECT))
    return made


@pytest.fixture(params=SEEDS)
def still(request):
    return pendulum(IMAGES, request.param, background=textured(request.param))[0]


def test_a_swinging_ball_before_a_still_camera_moves_no_camera(still):
    before = [one.copy() for one in still]
    found = camera_shift(still)
    assert found.stood
    assert found.largest_px < 0.5
    assert all((one == other).all() for one, other in zip(still, before, strict=True))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_shake_that_detectors_take_out_is_none(seed):
    found = camera_shift(pendulum(IMAGES, seed, background=textured(seed), shake_px=1.0)[0])
    assert found.stood
    assert found.largest_px < 4


@pytest.mark.parametrize("step", [(1.0, 0.2), (8.0, 0.0)])
def test_a_pan_is_found_with_its_size(still, step):
    places = np.arange(IMAGES)[:, None] * np.array(step)
    found = camera_shift(moved(still, places))
    off = np.hypot(*(places - np.median(places, axis=0)).T)
    assert not found.stood
    assert found.largest_px == pytest.approx(off.max(), rel=0.15)
    assert found.moved_part == pytest.approx(np.mean(off > STANDING_PX), abs=0.15)


def test_a_camera_held_by_hand_is_found(still):
    places = np.cumsum(np.random.default_rng(20340).normal(0, 4, (IMAGES, 2)), axis=0)
    assert camera_shift(moved(still, places)).moved_part > 0.4


def test_a_camera_that_was_bumped_is_off_from_then_on(still):
    places = np.where(np.arange(IMAGES)[:, None] < 14, 0.0, (7.0, -5.0))
    found = camera_shift(moved(still, places))
    assert found.shift_px[:14] == pytest.approx(0, abs=0.5)
    assert found.shift_px[14:] == pytest.approx(np.hypot(7, 5), abs=1)
    assert found.at(np.arange(IMAGES) / 10, np.array([0.55, 1.75])) == pytest.approx([0, np.hypot(7, 5)], abs=1)


def test_a_person_who_walks_through_moves_no_camera(still):
    coat = textured(20350)
    for number, image in enumerate(still):
        left = 10 * number
        image[60:, left : left + 60] = coat[60:, :60][:, : WIDTH - left]
    assert camera_shift(still).stood


def test_light_that_fades_moves_no_camera(still):
    fading = [(image * (1 - 0.02 * number)).astype(np.uint8) for number, image in enumerate(still)]
    assert camera_shift(fading).stood


def test_a_bare_wall_tells_nothing():
    found = camera_shift(pendulum(IMAGES, 20351, background=np.full((HEIGHT, WIDTH, 3), 150, np.uint8))[0])
    assert found.stood
    assert np.isnan(found.shift_px).all()
    assert found.at(np.arange(IMAGES), np.array([3.0])) == 0
    assert camera_shift([]).stood
