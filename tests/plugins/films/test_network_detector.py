"""A network of one's own finds the ball, by a heat map or by boxes; one that does not fit is refused in one line."""

import numpy as np
import pytest

from kendama_cli.errors import InputError, StageError
from kendama_cli.plugins.films.network_file import network_detector
from kendama_cli.plugins.films.settings import NetworkDetectorSettings
from kendama_cli.vision.detection.conformance import CHECKS, disc_image
from tests.plugins.films.onnx_file import disc_finder


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Networks that compute: what is redder inside a disc of 14 px than around it."""
    home = tmp_path_factory.mktemp("networks")
    for gives in ("heatmap", "boxes"):
        (home / f"{gives}.onnx").write_bytes(disc_finder(160, 120, 14.0, boxes=gives == "boxes"))
    (home / "odds.onnx").write_bytes(disc_finder(160, 120, 14.0, last="Identity"))
    (home / "text.onnx").write_text("no network")
    return home


def settings(files, name="heatmap", **changed):
    usual = {"output": name, "input_px": (160, 120), "scale": 1.0, "class_number": 0, "radius_px": 14.0}
    values = {"model": str(files / f"{name}.onnx"), **usual, "score_min": 0.5, "candidates": 6, **changed}
    return NetworkDetectorSettings(kind="network", **values)


@pytest.mark.parametrize("output", ["heatmap", "boxes"])
def test_a_network_keeps_the_laws_of_detectors(files, output):
    detector = network_detector(settings(files, output))
    for check in CHECKS:
        check(detector)


def test_images_are_scaled_for_the_network(files):
    detector = network_detector(settings(files, scale=0.5, radius_px=28.0))
    large = disc_image((70.3, 52.6)).repeat(2, axis=0).repeat(2, axis=1)
    found = next(detector.candidates(large))
    assert np.hypot(*(found.centre_px - (2 * np.array([70.3, 52.6]) + 0.5))) < 1.0
    assert found.radius_px == 28.0


def test_an_image_larger_than_the_input_says_which_scale_fits(files):
    detector = network_detector(settings(files))
    with pytest.raises(StageError, match=r"320 x 120 px does not fit .* of 160 x 120 px; predict.detector.scale=0.5"):
        next(detector.candidates(disc_image(width=320)))


def test_a_network_that_gives_no_probabilities_is_told(files):
    detector = network_detector(settings(files, "odds", output="heatmap"))
    with pytest.raises(StageError, match=r"values from -1\d\.\d\d to \d+\.\d\d where probabilities .* a sigmoid"):
        next(detector.candidates(disc_image((70.3, 52.6))))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"model": "nowhere.onnx"}, "nowhere.onnx: cannot be read"),
        ({"name": "text", "output": "heatmap"}, "it is not a network in ONNX"),
        ({"output": "boxes"}, r"its output has the shape \(1, 1, 120, 160\); of output=boxes"),
        ({"name": "boxes", "output": "heatmap"}, r"its output has the shape \(1, 5, 19200\); of output=heatmap"),
        ({"class_number": 3}, "of output=heatmap with class_number=3"),
        ({"name": "boxes", "input_px": (100, 100)}, "does not take an image of 100 x 100 px"),
    ],
)
def test_a_network_that_does_not_fit_is_refused_in_one_line(files, changed, message):
    with pytest.raises(InputError, match=message) as refused:
        network_detector(settings(files, **changed))
    assert len(str(refused.value).splitlines()) == 1
