"""The video: its clock, its images, its file, and what it says of places where none can be."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from kendama_cli.errors import InputError, MissingPartError
from kendama_cli.plugins.publication import video_file
from kendama_cli.plugins.publication.video_file import check_video_name, video_of_run, write_video
from kendama_cli.plugins.publication.video_maker import (
    AFTER_S,
    BEFORE_S,
    HEIGHT_PX,
    RATE_HZ,
    SLOWER,
    WIDTH_PX,
    VideoMaker,
    clock,
)
from tests.rendering.example_motion import example_motion
from tests.simulation.dart.bench_robot import kendama_game

GAME = kendama_game()


def test_the_video_is_slow_around_the_catch_and_true_to_time_elsewhere() -> None:
    moments = np.array(list(clock(3.0, 0.0, 4.0)))
    t_s, speed = moments.T
    np.testing.assert_allclose(np.diff(t_s), speed[:-1] / RATE_HZ, rtol=1e-9)
    around = (t_s > 3.0 - BEFORE_S) & (t_s < 3.0 + AFTER_S)
    np.testing.assert_allclose(speed[around], 1 / SLOWER)
    assert np.all(speed[np.abs(t_s - 3.0) > 0.7] == 1.0)
    assert np.abs(np.diff(speed)).max() < 0.2  # it eases
    assert around.sum() == pytest.approx((BEFORE_S + AFTER_S) * SLOWER * RATE_HZ, abs=2)
    assert {one for _, one in clock(None, 0.0, 1.0)} == {1.0}


def _ball(image: np.ndarray) -> tuple[int, float]:
    """Pixels of the ball's colour, and their mean column."""
    blue, green, red = np.moveaxis(image.astype(int), -1, 0)
    _, columns = np.nonzero((red > 1.6 * green) & (red > 2.5 * blue))
    return len(columns), float(columns.mean())


def test_the_images_show_ball_cup_and_arm_where_they_are() -> None:
    """The ball's disc has pi (f R / depth)^2 pixels; its rim mixes with what is behind it, and is not all counted."""
    maker = VideoMaker(example_motion(1.0), GAME)
    for t_s in (0.1, 0.9):
        place_m = np.array([[0.3 - 0.6 * t_s, 0.0, 1.35]])
        image = maker.image(t_s, 1.0)
        assert image.shape == (HEIGHT_PX, WIDTH_PX, 3)
        many, column = _ball(image)
        radius_px = maker.model.focal_px[0] * GAME.ball.radius_m / maker.model.depth_m(place_m)[0]
        assert many == pytest.approx(np.pi * radius_px**2, rel=0.25)
        assert column == pytest.approx(maker.model.project(place_m)[0, 0], abs=1.0)
    first = image
    blue, _, red = np.moveaxis(first.astype(int), -1, 0)
    assert ((blue > 2 * red) & (blue > 60)).sum() > 300  # the cup
    assert (np.ptp(first.astype(int), axis=-1) < 12)[first.max(axis=-1) < 150].sum() > 5000  # the post
    assert (first.min(axis=-1) > 225).mean() > 0.5  # light paper behind it all


def test_a_image_is_the_same_whatever_was_rendered_before() -> None:
    one, another = VideoMaker(example_motion(1.0), GAME), VideoMaker(example_motion(1.0), GAME)
    one.image(0.1, 1.0)
    np.testing.assert_array_equal(one.image(0.9, 1.0), another.image(0.9, 1.0))


def test_a_video_is_a_file_that_is_whole_or_not_there(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {0}, raising=False)
    images = write_video(example_motion(0.1), GAME, tmp_path / "catch.mp4")
    assert [path.name for path in tmp_path.iterdir()] == ["catch.mp4"]
    shown = _frames(tmp_path / "catch.mp4")
    assert len(shown) == images == 7
    assert shown[0].shape == (HEIGHT_PX, WIDTH_PX, 3)
    assert _ball(shown[0])[0] > 100


def _killed(folder: str) -> None:
    """Render in a process of its own, and end it as kill -9 does once the first pictures are stored."""

    def kill(done: int, total: int) -> None:
        if done >= 8:
            os.kill(os.getpid(), signal.SIGKILL)

    write_video(example_motion(0.2), GAME, Path(folder) / "catch.webm", kill)


def _frames(path: Path) -> list[np.ndarray]:
    video, shown = cv2.VideoCapture(str(path)), []
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(RATE_HZ, rel=0.01)
    while (read := video.read())[0]:
        shown.append(read[1])
    return shown


def test_a_video_that_was_killed_resumes_with_the_pictures_that_are_stored(tmp_path: Path) -> None:
    folder = tmp_path / "killed"
    folder.mkdir()
    process = multiprocessing.get_context("spawn").Process(target=_killed, args=(str(folder),))
    process.start()
    process.join(240)
    assert process.exitcode == -signal.SIGKILL
    assert not (folder / "catch.webm").exists()
    (parts,) = folder.glob(".catch.webm.parts-*")
    time.sleep(1.0)  # workers end with their parent
    before = {path.name: path.stat().st_mtime_ns for path in parts.glob("*.zst")}
    assert before
    told: list[tuple[int, int]] = []

    def look(done: int, total: int) -> None:
        told.append((done, total))
        assert {name: (parts / name).stat().st_mtime_ns for name in before} == before, "pictures are used again"

    count = write_video(example_motion(0.2), GAME, folder / "catch.webm", look)
    assert told == [(done, count) for done in (8, count)]
    assert [path.name for path in folder.iterdir()] == ["catch.webm"]
    write_video(example_motion(0.2), GAME, tmp_path / "whole.webm")
    for one, other in zip(_frames(folder / "catch.webm"), _frames(tmp_path / "whole.webm"), strict=True):
        np.testing.assert_array_equal(one, other)


def test_stored_pictures_of_another_motion_or_damaged_ones_are_not_used(tmp_path: Path) -> None:
    assert video_file._digest(example_motion(0.1), GAME) != video_file._digest(example_motion(0.2), GAME)
    parts = tmp_path / f".catch.webm.parts-{video_file._digest(example_motion(0.1), GAME)}"
    parts.mkdir()
    (parts / "00000.zst").write_bytes(b"torn")
    assert write_video(example_motion(0.1), GAME, tmp_path / "catch.webm") == len(_frames(tmp_path / "catch.webm")) == 7
    assert _ball(_frames(tmp_path / "catch.webm")[0])[0] > 100


def test_without_its_extra_an_mp4_says_what_to_install(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(
        MissingPartError,
        match=r"\.mp4 needs PyAV; pip install '\.\[film\]' in a checkout of kendama, or name the video .webm",
    ):
        write_video(example_motion(0.1), GAME, tmp_path / "catch.mp4")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("catch.avi", r"catch.avi: a video ends in .webm or .mp4; name it catch.webm"),
        ("catch", r"catch: a video ends in .webm or .mp4; name it catch.webm"),
        ("nowhere/catch.webm", r"catch.webm: its folder is not there; make the folder, or name another one"),
        ("folder.webm", r"folder.webm: it is a folder; name a file"),
    ],
)
def test_a_place_where_no_video_can_be_is_reported_in_one_line(tmp_path: Path, name: str, said: str) -> None:
    (tmp_path / "folder.webm").mkdir()
    with pytest.raises(InputError, match=said) as caught:
        check_video_name(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_a_folder_that_may_not_be_written_is_reported_before_anything_is_rendered(tmp_path: Path, monkeypatch) -> None:
    def refused(self: Path, **how: object) -> None:
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "touch", refused)  # root may write anywhere
    with pytest.raises(InputError, match="the video cannot be written there; name a folder that you may write to"):
        write_video(example_motion(0.1), GAME, tmp_path / "catch.webm")
    assert list(tmp_path.iterdir()) == []


def test_a_run_whose_logs_move_nothing_is_reported_in_one_line(tmp_path: Path) -> None:
    record = {"run": "00007-abc", "stages": [{"name": "encode", "artifact": None}]}
    with pytest.raises(InputError, match="run 00007-abc: no log of it moves a cup and a ball; render a run of adapt"):
        video_of_run([record], tmp_path / "catch.webm")
    with pytest.raises(InputError, match="2 runs are chosen; name one run: a video shows one"):
        video_of_run([record, record], tmp_path / "catch.webm")
