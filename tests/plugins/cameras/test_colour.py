"""Learning the ball's colour from clicks, and finding the ball by it."""

import cv2
import numpy as np
import pytest

from kendama_cli.plugins.cameras.colour_learning import learn_colour, learn_from_clicks
from kendama_cli.vision.detection.colour import HsvThresholds, LearnedColour
from kendama_cli.vision.detection.colour_detector import ColourDetector
from tests.vision.scenes import first_found, predict
from tests.vision.studio import CUP, Studio


@pytest.fixture(scope="module")
def learned():
    studio, images, clicks = Studio("bright", seed=3), [], []
    for ball in ([0.1, 0.0, 0.3], [-0.2, 0.0, 0.15], [0.2, 0.0, 0.1]):
        images.append(studio.shoot(ball).pixels)
        clicks.append(studio.true_centre() + np.array([1.5, -1.0]))  # nobody clicks on the middle
    return learn_from_clicks(images, clicks, 7.0)


@pytest.mark.parametrize("light", ["bright", "dim", "side"])
def test_three_clicks_in_bright_light_find_the_ball_in_every_light(learned, light):
    studio, detector = Studio(light, seed=4, cup=CUP), ColourDetector(predict().detector, learned)
    for ball in ([0.0, 0.0, 0.35], [0.25, 0.0, 0.2], [-0.15, 0.0, 0.4]):
        seen = first_found(detector, studio.shoot(ball).pixels)
        assert np.abs(seen.centre_px - studio.true_centre()).max() < 0.3
    studio.ball = np.array([5.0, 0.0, 0.3])
    assert first_found(detector, studio.shoot([5.0, 0.0, 0.3]).pixels) is None


def test_a_ball_of_any_colour_is_learned():
    """Green, on a scene of other hues: shaded to a quarter of its brightness it is still known."""
    rng = np.random.default_rng(5)
    image = rng.integers(60, 200, (120, 160, 3)).astype(np.uint8) // 8 * 8
    image[:, :, 1] = image[:, :, 1] // 3
    rows, columns = np.mgrid[:120, :160]
    disc = np.hypot(columns - 80, rows - 60)[..., None]
    shade = 0.25 + 0.75 * (columns / 160)[..., None]
    image = np.where(disc < 12, shade * [40, 220, 60], image).astype(np.uint8)
    model = learn_from_clicks([image], [(80, 60)], 12.0)
    mask = model.mask(image) > 0
    assert mask[disc[..., 0] < 11].mean() > 0.95
    assert mask[disc[..., 0] > 13].mean() < 0.02


def test_a_model_is_written_and_read_back_exactly(learned):
    again = LearnedColour.from_json(learned.to_json())
    assert np.array_equal(again.log_odds, learned.log_odds)
    assert again.value_min == learned.value_min


@pytest.mark.parametrize("text", ["", "{}", '{"value_min": 3, "log_odds": [[1]]}', "[1]"])
def test_a_text_that_holds_no_model_is_refused(text):
    with pytest.raises(ValueError, match="no colour model of 30 x 16 log odds"):
        LearnedColour.from_json(text)


def test_what_cannot_be_learned_is_refused():
    grey = np.full((50, 3), 120, dtype=np.uint8)
    with pytest.raises(ValueError, match="only 0% of the ball's pixels differ in colour"):
        learn_colour(grey, grey)
    with pytest.raises(ValueError, match="0 pixels of the ball and 50 of what is around it"):
        learn_colour(grey[:0], grey)


def test_thresholds_run_through_red():
    hues = np.array([[[175, 200, 200], [5, 200, 200], [60, 200, 200], [175, 60, 200]]], dtype=np.uint8)
    pixels = cv2.cvtColor(hues, cv2.COLOR_HSV2BGR)
    assert HsvThresholds(predict().detector).mask(pixels).tolist() == [[255, 255, 0, 0]]
