"""kendama camera: a check of what cameras see, and a colour learned by a click."""

import json

import cv2
import numpy as np
import pytest
import yaml

from tests.cli.typed import kendama, refused
from tests.devices.camera.image_folder import images

RECORDED = ("camera", "check", "camera=file", "camera.paths=[times.csv]")


def one_camera():
    """The shipped left camera at the size of the test's images."""
    return (
        "camera.cameras=[{name: left, width_px: 64, height_px: 48, focal_px: [60, 60], center_px: [31.5, 23.5], "
        "distortion: [0, 0, 0, 0, 0], position_m: [0, -1.5, 0.2], look_at_m: [0, 0, 0.2], rotation_wxyz: null}]"
    )


def disc(path, colour=(30, 40, 200), grey=120):
    """A ball of radius 9 px at (40, 30) before noise."""
    rng = np.random.default_rng(10000)
    pixels = np.full((64, 96, 3), grey, dtype=np.uint8)
    cv2.circle(pixels, (40, 30), 9, colour, -1)
    cv2.imwrite(str(path), np.clip(pixels + rng.normal(0, 4, pixels.shape), 0, 255).astype(np.uint8))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("cameras: [", "it cannot be read as a calibration (while parsing|it cannot be read as a calibration ("),
        ("left: 3", "it has no list 'cameras'; make one with 'kendama camera calibrate'"),
        ("cameras: [{name: left}]", "make one with 'kendama camera calibrate'"),
    ],
)
def test_a_file_that_is_no_calibration_is_refused(here, capsys, content, message):
    (here / "bad.yaml").write_text(content)
    line = refused(capsys, "camera", "check", "camera.calibration=bad.yaml")
    assert "bad.yaml" in line
    assert any(part in line for part in message.split("|"))


def test_check_tells_rate_and_sightings_of_virtual_cameras_and_draws_them(here, capsys):
    code, out, err = kendama(capsys, "camera", "check", "--seconds", "0.1", "-o", "seen.png", "--json")
    assert code == 0, err
    shown = json.loads(out)["cameras"]
    for one in shown.values():
        assert one["frames"] == 12
        assert one["rate_hz"] == pytest.approx(120)
        assert one["missed"] == one["doubled"] == 0
        assert one["seen"] > 0.9
        assert one["latency_ms_p50"] is None  # simulated time knows none
        assert one["detection_ms_p50"] > 0
        assert 5 < one["radius_px_p50"] < 12
    assert cv2.imread("seen.png").shape == (480, 1280, 3)


def test_check_counts_missed_and_doubled_frames_of_a_recording(here, capsys):
    rows = ["file,t_s", *(f"{min(i, 5):03d}.png,{i / 50}" for i in range(10) if i != 3)]
    images(here, n=10, rows=rows)
    code, out, err = kendama(
        capsys, "camera", "check", "camera=file", "camera.paths=[times.csv]", one_camera(), "--json"
    )
    assert code == 0, err
    shown = json.loads(out)["cameras"]["left"]
    assert (shown["frames"], shown["missed"], shown["doubled"]) == (9, 1, 4)
    assert shown["rate_hz"] == pytest.approx(50)
    assert shown["seen"] == 0


def test_a_colour_is_learned_from_a_click_and_the_detector_goes_by_it(here, capsys):
    disc(here / "blue.png", colour=(200, 60, 30))
    code, out, err = kendama(capsys, "camera", "colour", "blue.png@40,30", "--radius-px", "9", "-o", "blue.json")
    assert code == 0, err
    assert "use it with predict.detector.colour=blue.json" in out
    words = ("camera", "check", "--seconds", "0.05", "--json")
    seen = {}
    for colour in ("null", "blue.json"):
        code, out, err = kendama(capsys, *words, f"predict.detector.colour={colour}")
        assert code == 0, err
        seen[colour] = json.loads(out)["cameras"]["left"]["seen"]
    assert seen == {"null": 1.0, "blue.json": 0.0}  # the ball of the virtual scene is red


@pytest.mark.parametrize(
    ("click", "message"),
    [
        ("ball.png", "ball.png: give an image and the ball's middle in it, such as left.png@320,200"),
        ("ball.png@400,30", "the place lies outside the image of 96 x 64 px; u counts columns, v rows"),
        ("gone.png@1,2", "gone.png: no such file or folder"),
        ("grey.png@40,30", "point at the ball in a well lit image"),
    ],
)
def test_a_colour_that_cannot_be_learned_is_one_line(here, capsys, click, message):
    disc(here / "ball.png")
    cv2.imwrite(str(here / "grey.png"), np.full((64, 96, 3), 120, dtype=np.uint8))
    assert message in refused(capsys, "camera", "colour", click, "--radius-px", "9")
    assert not (here / "ball.json").exists()


def test_check_refuses_a_picture_of_another_kind_and_a_recording_without_frames_in_time(here, capsys):
    assert "seen.jpg: a picture is a PNG; name it seen.png" in refused(
        capsys, "camera", "check", "--seconds", "0.05", "-o", "seen.jpg"
    )
    images(here, n=1, rows=["file,t_s", "000.png,9"])
    code, _, err = kendama(capsys, *RECORDED, one_camera())
    assert code == 1
    assert "no camera gave a frame within 2 s; look longer, or check the recording's times" in err


def test_a_missing_device_is_one_line(here, capsys):
    line = refused(capsys, "camera", "check", "camera=device", "camera.indices=[97,98]")
    assert "no camera answers at index 97" in line


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lens": "fish"}, "'cameras.0.lens' is 'fish'; allowed: radial"),
        ({"distortion": [0.0] * 4}, "'cameras.0.distortion' must have 5 values, not 4"),
    ],
)
def test_a_lens_that_is_none_is_one_line(here, capsys, change, message):
    one = {
        "name": "left", "width_px": 640, "height_px": 480, "focal_px": [300.0, 300.0], "center_px": [320.0, 240.0],
        "distortion": [0.0] * 5, "position_m": [0.0, -1.0, 0.2], "look_at_m": [0.0, 0.0, 0.2], "rotation_wxyz": None,
    }  # fmt: skip
    (here / "lens.yaml").write_text(yaml.safe_dump({"cameras": [one | change]}))
    assert message in refused(capsys, "camera", "check", "camera.calibration=lens.yaml")
