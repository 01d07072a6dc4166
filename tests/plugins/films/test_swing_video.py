"""capture=video: swings out of films with boxes about ball and cup, and what a film must show for it."""

from __future__ import annotations

import functools
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.errors import ConfigError, InputError
from kendama_cli.plugins.films.ball_box import BallBox, TrainedImage
from kendama_cli.plugins.films.box_follower import DETECTOR, BoxTrack, Placer
from kendama_cli.plugins.films.settings import TrainedDetectorSettings
from kendama_cli.plugins.films.swing_boxes import box_files
from kendama_cli.plugins.films.swing_settings import SwingVideoCapture
from kendama_cli.plugins.films.swing_video import swings
from kendama_cli.plugins.shared.videos.video import VideoFile
from kendama_cli.schema.settings import build
from tests.cli.typed import refused
from tests.plugins.films.swing_film import Shoot, camera, filmed, person_swing, write_boxes, write_film
from tests.shipped_conf import plain
from tests.vision.scenes import game

CONF = Path(__file__).parents[3] / "conf/capture/video.yaml"
TIE_M = game().cup.depth_m / 2
NOISE_PX = 0.4


def settings(path, **changes):
    data = yaml.safe_load(CONF.read_text()) | {"path": str(path)}
    return build(SwingVideoCapture, data | changes, "capture")


@functools.cache
def person():
    return person_swing(12)


def seen(shoot, seed=10000, hidden=(), ball_hidden=()):
    """Times and tracks as of a perfect detector with noise; images of these numbers do not show cup or ball."""
    rng, model, swing = np.random.default_rng(seed), camera(shoot), person()
    t_s = np.arange(0.0, swing.t_s[-1], 1 / shoot.rate_hz)
    tracks = {}
    for thing, path_m, radius_m, gone in (
        ("cup", swing.cup_m + np.array([0.0, 0.0, TIE_M]), 0.035, hidden),
        ("ball", swing.ball_m, 0.02, ball_hidden),
    ):
        frames = np.array([k for k in range(len(t_s)) if k not in gone])
        place_m = np.column_stack([np.interp(t_s[frames], swing.t_s, one) for one in path_m.T])
        places = model.project(place_m) + rng.normal(0, NOISE_PX, (len(frames), 2))
        tracks[thing] = BoxTrack(frames, places, shoot.focal_px * radius_m / shoot.away_m)
    return t_s, tracks


def read(t_s, tracks, **changes):
    return swings(Path("a.mp4"), t_s, tracks, settings("a.mp4", **{"string_m": 0.4, "tie_m": TIE_M, **changes}), ())


def error_m(found):
    """Rms distance in the plane from the true path, whose first image is that of the recording."""
    swing = person()
    late = [float(one) for one in np.arange(0.0, 0.6, 0.005)]
    paths = (np.column_stack([np.interp(found.t_s + one, swing.t_s, path) for path in swing.cup_m.T]) for one in late)
    apart = [(found.position_m - path)[:, [0, 2]] for path in paths]
    return min(float(np.sqrt(((one - one.mean(axis=0)) ** 2).sum(axis=1).mean())) for one in apart)


@pytest.mark.parametrize(
    ("shoot", "most_mm"),
    [
        (Shoot(rate_hz=30.0), 1.6),
        (Shoot(rate_hz=60.0, roll_deg=15.0), 1.6),
        (Shoot(rate_hz=30.0, roll_deg=90.0, width_px=720, height_px=1280), 1.6),
        (Shoot(rate_hz=30.0, away_m=4.0), 3.2),
        (Shoot(rate_hz=30.0, yaw_deg=20.0), 12.0),
    ],
)
def test_the_string_gives_the_scale_and_the_hanging_ball_the_vertical(shoot, most_mm):
    """Noise of 0.4 px is 0.8 mm from 2 m, 1.1 in the plane; from 20 degrees beside, x is 6 % short: 9 mm of 150."""
    (found,) = read(*seen(shoot))
    assert 1e3 * error_m(found) < most_mm
    assert "by the string" in found.warnings[0]
    assert "neither depth nor turn" in found.warnings[-1]


def test_without_a_string_gravity_gives_the_scale_and_says_how_well():
    (found,) = read(*seen(Shoot(rate_hz=60.0)), string_m=None)
    shown = re.search(r"1 px is ([\d.]+) mm \(\+-(\d+)%\) by gravity in 0\.\d s of free flight", found.warnings[0])
    assert float(shown[1]) == pytest.approx(2.0, rel=3 * int(shown[2]) / 100)
    assert 0 < int(shown[2]) <= 3


def test_a_string_that_is_too_long_is_told_by_gravity():
    (found,) = read(*seen(Shoot(rate_hz=60.0)), string_m=0.50)
    assert any("of what the string's length says: measure the string" in one for one in found.warnings)


def test_a_slow_motion_video_is_told_by_gravity():
    t_s, tracks = seen(Shoot(rate_hz=60.0))
    with pytest.raises(
        InputError, match=r"the video's times are [78](\.\d)? times as long as the swing's.*capture.rate_hz"
    ):
        read(8 * t_s, tracks)


def test_a_ball_that_stays_in_the_cup_shows_no_string():
    t_s, tracks = seen(Shoot(rate_hz=30.0))
    held = BoxTrack(tracks["cup"].frames, tracks["cup"].places_px, tracks["ball"].radius_px)
    with pytest.raises(InputError, match="the string is never taut"):
        read(t_s, tracks | {"ball": held})
    with pytest.raises(InputError, match=r"the ball never flies for 0\.15 s.*capture\.string_m"):
        read(t_s, tracks | {"ball": held}, string_m=None)


def test_short_gaps_are_filled_and_long_ones_end_a_swing():
    shoot = Shoot(rate_hz=30.0)
    (found,) = read(*seen(shoot, hidden=range(50, 52), ball_hidden=range(40, 60)))
    assert 1e3 * error_m(found) < 3.0
    t_s, tracks = seen(shoot, hidden=range(50, 70))
    pieces = read(t_s, tracks, segments="one")
    assert len(pieces) == 2
    assert sum(len(one.t_s) for one in pieces) == len(t_s) - 20
    with pytest.raises(InputError, match=r"never followed for 0\.5 s without a gap of 0\.12 s"):
        read(*seen(shoot, hidden=[k for k in range(200) if k % 10 < 5]))


def test_what_is_hardly_seen_is_told_with_what_to_type():
    t_s, tracks = seen(Shoot(rate_hz=30.0), ball_hidden=range(5, 200))
    with pytest.raises(InputError, match=r"ball is seen in 5 of \d+ images.*kendama camera train a\.mp4 --cup"):
        read(t_s, tracks)
    cup = tracks["cup"]
    apart = BoxTrack(cup.frames[30:], cup.places_px[30:], cup.radius_px)
    ball = seen(Shoot(rate_hz=30.0), ball_hidden=range(20, 200))[1]["ball"]
    with pytest.raises(InputError, match="ball and cup are seen together in 0 images"):
        read(t_s, {"ball": ball, "cup": apart})


def test_a_picture_places_what_keeps_its_shape_to_a_tenth_of_a_pixel():
    """Three boxes, off by one pixel each: their mean is the middle."""
    rng = np.random.default_rng(10000)
    texture = cv2.resize(rng.integers(0, 255, (12, 16, 3)).astype(np.uint8), (48, 36), interpolation=cv2.INTER_CUBIC)
    wall = np.full((200, 300, 3), 120, np.uint8)

    def shown(u, v):
        way = np.array([[1.0, 0.0, u - 23.5], [0.0, 1.0, v - 17.5]])
        return cv2.warpAffine(texture, way, (300, 200), dst=wall.copy(), borderMode=cv2.BORDER_TRANSPARENT)

    drawn = [(100.0, 90.0, -1.0, 0.0), (150.0, 60.0, 1.0, -1.0), (200.0, 120.0, 0.0, 1.0)]
    images = [TrainedImage(shown(u, v), (BallBox(u + a, v + b, 48.0, 36.0),)) for u, v, a, b in drawn]
    placed = Placer(images).placed(shown(130.3, 75.6), np.array([134.0, 72.0]))
    assert placed == pytest.approx([130.3, 75.6], abs=0.15)
    assert Placer(images).placed(wall, np.array([130.0, 70.0])) == pytest.approx([130.0, 70.0])


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """The swing from 1 m, in a small image."""
    folder = tmp_path_factory.mktemp("film")
    shoot = Shoot(width_px=560, height_px=640, focal_px=500.0, away_m=1.0, rate_hz=30.0)
    made = filmed(person(), shoot, 10000)
    write_film(folder / "swing.mp4", made, shoot.rate_hz)
    write_boxes(folder / "swing-boxes", "swing", made, 10000)
    return folder / "swing.mp4"


@pytest.mark.slow
def test_a_rendered_film_becomes_its_swing(film):
    """Here 1 px is 2 mm; boxes are off by a pixel."""
    told = []
    (hand,) = open_demonstrators(
        settings(film, string_m=0.4, tie_m=TIE_M), lambda done, total: told.append((done, total))
    )
    images = VideoFile(film).count()
    assert told == [(image, images) for image in range(images + 1)]
    assert 1e3 * error_m(hand._recording) < 4.0


def test_boxes_that_are_missing_are_asked_for(tmp_path, capsys, here):
    made = filmed_still(tmp_path / "a.mp4")
    with pytest.raises(InputError, match=r"no boxes show its ball.*draw them: kendama camera train .*a\.mp4 --cup"):
        box_files(made)
    line = refused(capsys, "run", "--until", "capture", "capture=video", f"capture.path={made}")
    assert "kendama camera train" in line
    line = refused(capsys, "camera", "train", str(made), "--cup", "-o", "boxes")
    assert "leave out one of the two" in line
    with pytest.raises(ConfigError, match=r"tie_m' is 0\.5; allowed: below string_m"):
        settings(made, string_m=0.4, tie_m=0.5)


def filmed_still(path):
    """A film without a ball."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 30.0, (320, 240))
    for _ in range(30):
        writer.write(np.full((240, 320, 3), 90, np.uint8))
    writer.release()
    assert VideoFile(path).count() == 30
    return path


def test_the_follower_detects_as_the_shipped_detector() -> None:
    shipped = {**plain("predict/detector", "trained"), "ball": ""}
    assert build(TrainedDetectorSettings, shipped, "detector") == DETECTOR
