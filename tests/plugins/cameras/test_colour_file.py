"""A learned colour as a file: found again by the detector, refused where it is none."""

import dataclasses

import numpy as np
import pytest

from kendama_cli.errors import InputError
from kendama_cli.plugins.cameras.colour_learning import learn_from_clicks
from kendama_cli.vision.detection.colour_detector import colour_detector, read_colour
from tests.vision.scenes import first_found, predict
from tests.vision.studio import Studio


def test_a_detector_goes_by_the_file_that_its_settings_name(tmp_path):
    studio = Studio()
    pixels = studio.shoot([0.1, 0.0, 0.3]).pixels
    path = tmp_path / "ball.json"
    path.write_text(learn_from_clicks([pixels], [studio.true_centre()], 7.0).to_json())
    blind = dataclasses.replace(predict().detector, colour=str(path), hue_low=60, hue_high=80)  # thresholds of green
    assert np.abs(first_found(colour_detector(blind), pixels).centre_px - studio.true_centre()).max() < 0.3
    assert first_found(colour_detector(dataclasses.replace(blind, colour=None)), pixels) is None


@pytest.mark.parametrize("content", [b"no json", b"{}", b"\xff\xfe"])
def test_a_file_that_is_no_colour_is_reported_in_one_line(tmp_path, content):
    path = tmp_path / "ball.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"ball\.json: .*; learn the colour again") as caught:
        read_colour(str(path))
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="cannot be read"):
        read_colour(str(tmp_path / "none.json"))
