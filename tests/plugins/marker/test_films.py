"""A printed marker in rendered films: followed through blur and gaps, or told in one line why not."""

from __future__ import annotations

import itertools
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.errors import ConfigError, HardwareError, InputError
from kendama_cli.plugins.marker.detection import MarkerDetector
from kendama_cli.plugins.marker.settings import MarkerCapture, MarkerLiveCapture
from kendama_cli.schema.settings import build
from tests.plugins.marker.marker_film import FIELD_DEG, FOCAL, picture, turned, write_film

CONF = Path(__file__).parents[3] / "conf" / "capture"
RATE_HZ = 30.0
PLAUSIBLE = yaml.safe_load((CONF / "marker.yaml").read_text())["plausible"]


def settings(path, name="marker", **changes):
    data = yaml.safe_load((CONF / f"{name}.yaml").read_text()) | {"field_of_view_deg": FIELD_DEG}
    if name == "marker":
        data["path"] = str(path)
    return build(MarkerCapture if name == "marker" else MarkerLiveCapture, data | changes, "capture")


def motion():
    """A swing of 1 s with rest on either side, in the middle of the picture at 1.2 m, and the marker's tilt."""
    rows = np.loadtxt(CONF.parents[1] / "data/demonstrations/swing-01.csv", delimiter=",", comments=("#", "t"))
    t_s, place_m = rows[:, 0], rows[:, 1:] - rows[:, 1:].mean(axis=0) + [0.0, 1.2, 0.0]
    tilt = 0.25 + 0.2 * np.sin(2 * np.pi * t_s / t_s[-1])
    return t_s, place_m, np.column_stack((tilt, 0.3 + 0 * tilt, 0 * tilt))


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / "swing.avi"
    return write_film(path, *motion(), rate_hz=RATE_HZ, exposure_s=0.003, hidden=range(35, 37))


@pytest.fixture(scope="module")
def followed(film):
    (hand,) = open_demonstrators(settings(film))
    return hand


def test_a_filmed_swing_is_followed_through_blur_and_a_gap(followed):
    t_s, place_m, _ = motion()
    hand, samples = followed, list(followed.samples())
    at = np.array([one.t_s for one in samples])
    made = np.array([one.position_m for one in samples])
    truth = np.column_stack([np.interp(at + t_s[0], t_s, column) for column in place_m.T])
    error_m = np.sqrt(np.mean((made - truth) ** 2, axis=0))
    assert error_m[[0, 2]].max() < 0.003  # across the view; three times what was measured over 8 seeds
    assert error_m[1] < 0.02  # along it
    assert any("capture.size_m = 0.04 m" in one for one in hand.warnings)
    assert np.linalg.norm([one.rotation_wxyz for one in samples], axis=1) == pytest.approx(1.0, abs=1e-9)
    tilt = 2 * np.arcsin(np.abs(np.array([one.rotation_wxyz for one in samples])[:, 1]))
    assert np.degrees(tilt.max()) == pytest.approx(np.degrees(0.2), abs=3)


def test_lengths_and_times_follow_the_declared_size_and_rate(film, followed):
    (hand,) = open_demonstrators(
        settings(film, size_m=0.05, rate_hz=2 * RATE_HZ, plausible={**PLAUSIBLE, "axes": "off"})
    )
    sizes = [np.ptp([one.position_m for one in one.samples()], axis=0) for one in (followed, hand)]
    assert sizes[1] == pytest.approx(1.25 * sizes[0], rel=0.05)
    assert hand.rate_hz == pytest.approx(2 * RATE_HZ)
    assert any("capture.size_m = 0.05 m" in one for one in hand.warnings)


def test_a_long_gap_is_told_with_its_place(tmp_path):
    path = write_film(tmp_path / "a.avi", *motion(), rate_hz=10.0, exposure_s=0.001, hidden=range(10, 14))
    with pytest.raises(InputError, match=r"frame at 0\.90 s: the marker is not seen for 0\.50 s; allowed: 0\.12 s"):
        open_demonstrators(settings(path))


def test_another_marker_is_not_taken_for_it(tmp_path):
    t_s, place_m, turns = motion()
    short = write_film(tmp_path / "a.avi", t_s[:40], place_m[:40], turns[:40], rate_hz=10.0, exposure_s=0.001)
    with pytest.raises(InputError, match=r"marker 1 of 4x4_50 is seen in 0 of 3 frames"):
        open_demonstrators(settings(short, number=1))


@pytest.mark.parametrize("way", [(1.0, 0.0), (0.0, 1.0), (0.7, 0.7)])
def test_a_marker_that_is_too_blurred_to_be_read_is_found_where_it_was(way):
    """It has 20 px and is blurred over 9; a small print in its place is not taken for it."""
    rng, detector = np.random.default_rng(10000), MarkerDetector("4x4_50", 0)
    place_m, facing = np.array([0.02, 0.01, 1.2]), turned((0.1, 0.1, 0.0))
    before = detector.find(picture([place_m], [facing], 0.04, rng))
    motion_m = 9 / FOCAL * 1.2 * np.array([*way, 0.0])
    at_m = [place_m + [0.01, 0.01, 0.0] + motion_m * part for part in np.linspace(-0.5, 0.5, 9)]
    blurred = picture(at_m, [facing] * 9, 0.04, rng)
    assert detector.find(blurred) is None
    found = detector.find(blurred, before)
    assert found.centre_px - before.centre_px == pytest.approx([5.0, 5.0], abs=1.0)
    assert detector.find(picture([place_m], [facing], 0.004, rng), before) is None


def test_what_is_no_film_is_told(tmp_path):
    (tmp_path / "a.mp4").write_bytes(b"no film")
    with pytest.raises(InputError, match="OpenCV cannot read it as a video"):
        open_demonstrators(settings(tmp_path / "a.mp4"))
    with pytest.raises(InputError, match="no such file"):
        open_demonstrators(settings(tmp_path / "b.mp4"))


def test_two_lenses_are_one_too_many():
    with pytest.raises(ConfigError, match="give it or calibration, one of the two; both are set"):
        settings("a.mp4", calibration="a.yaml")


def test_lengths_across_the_view_do_not_depend_on_the_lens(film, followed):
    """The film is 56 degrees wide; without a field of view 65 are taken, and depth alone is wrong by them."""
    (hand,) = open_demonstrators(settings(film, field_of_view_deg=None))
    sizes = [np.ptp([one.position_m for one in one.samples()], axis=0) for one in (followed, hand)]
    assert sizes[1][[0, 2]] == pytest.approx(sizes[0][[0, 2]], rel=0.01)


def test_a_device_is_recorded_and_its_film_kept_and_never_overwritten(film, tmp_path):
    record = tmp_path / "kept.avi"
    live = settings(None, "marker_live", device=str(film), record=str(record), seconds=120.0)
    (hand,) = open_demonstrators(live)
    kept = cv2.VideoCapture(str(record))
    count = round(cv2.VideoCapture(str(film)).get(cv2.CAP_PROP_FRAME_COUNT))
    assert kept.get(cv2.CAP_PROP_FRAME_COUNT) == count
    assert hand.name == "kept"
    assert any(f"went away after {count} frames; what came before is kept in {record}" in one for one in hand.warnings)
    with pytest.raises(ConfigError, match="which exists; a recording is never overwritten"):
        open_demonstrators(live)


def test_a_camera_that_is_not_there(tmp_path):
    live = settings(None, "marker_live", device=str(tmp_path / "none.avi"), record=str(tmp_path / "b.avi"))
    with pytest.raises(HardwareError, match=r"is not there; look at capture\.device"):
        open_demonstrators(live)


def test_a_camera_that_is_slower_than_it_says_is_told_and_its_true_rate_taken(film, tmp_path, monkeypatch):
    """A film of 30 frames a second whose frames come 25 times a second by the clock, which is read twice for each."""
    reads = itertools.count()
    monkeypatch.setattr("kendama_cli.plugins.marker.live.time.monotonic", lambda: next(reads) / 2 / 25)
    own = {"device": str(film), "record": str(tmp_path / "a.avi"), "seconds": 120.0, "max_gap_s": 0.2}
    (hand,) = open_demonstrators(settings(None, "marker_live", **own))
    assert any("gave 25.0 frames a second where it says 30: the former are taken" in one for one in hand.warnings)
    assert hand.rate_hz == pytest.approx(25.0, rel=0.01)
