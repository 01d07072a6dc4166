"""kendama camera track on films that are damaged, turned or do not fit: told in one line, never a wrong track."""

import cv2
import numpy as np
import pytest
import yaml

from tests.cli.test_camera_seeing import camera, rows
from tests.cli.typed import kendama, refused
from tests.devices.camera.test_film import turn, turn_on_its_side
from tests.vision.ball_films import HEIGHT, WIDTH, pendulum, textured, write_film


@pytest.fixture(scope="module")
def swing():
    return pendulum(24, 10320, background=textured(10321))[0]


def test_a_damaged_film_is_tracked_up_to_the_damage_and_that_is_told(here, capsys, swing):
    write_film(here / "swing.avi", swing)
    data = bytearray((here / "swing.avi").read_bytes())
    middle = len(data) // 2
    data[middle : middle + 30_000] = bytes(30_000)
    (here / "swing.avi").write_bytes(data)
    code, _, err = kendama(capsys, "camera", "track", "swing.avi", "-o", "swing.csv")
    assert code == 0, err
    (line,) = [line for line in err.splitlines() if "damaged" in line]
    assert "of its 24 frames; an AVI does not say when a frame was taken" in line
    assert 6 <= len(rows(here / "swing.csv")) <= 14


def test_a_turned_film_is_refused_where_lines_or_size_matter(here, capsys, swing):
    write_film(here / "film.mp4", swing, "mp4v")
    turn_on_its_side(here / "film.mp4")
    words = ["camera", "track", "film.mp4", "--ball-mm", "60", "--calibration", "one.yaml"]
    (here / "one.yaml").write_text(yaml.safe_dump({"cameras": [camera("film", 0.0)]}))
    line = refused(capsys, *words)
    assert "it has 240 x 320 px, turned by " in line
    assert "as its metadata says, but camera 'film' was calibrated with 320 x 240 px" in line
    upright = camera("film", 0.0, (240, 320)) | {"center_px": [119.5, 159.5], "readout_s": 0.02}
    (here / "one.yaml").write_text(yaml.safe_dump({"cameras": [upright]}))
    assert "so its shutter's lines are columns; film with the camera level" in refused(capsys, *words)
    (here / "one.yaml").write_text(yaml.safe_dump({"cameras": [camera("film", 0.0) | {"readout_s": 0.02}]}))
    turn(here / "film.mp4", -1, 0, 0, -1)
    assert "so its shutter's lines run upwards" in refused(capsys, *words)


def test_a_film_without_a_ball_gives_no_track_but_one_line_with_the_evidence(here, capsys):
    rng, wall = np.random.default_rng(10322), textured(10323)
    write_film(
        here / "wall.mp4", [(wall + rng.normal(0, 6, wall.shape)).clip(0, 255).astype(np.uint8) for _ in range(40)]
    )
    code, out, err = kendama(capsys, "camera", "track", "wall.mp4", "-o", "wall.csv")
    assert (code, out) == (1, "")
    (line,) = [line for line in err.splitlines() if "no ball found" in line]
    assert "it is seen in no frame" in line or ("smooth stretch has" in line and "on smooth arcs" in line)
    assert "--box FRAME:X,Y,W,H" in line
    assert not (here / "wall.csv").exists()


def panned(frames, step_px):
    moved = []
    for number, frame in enumerate(frames):
        way = np.array([[1, 0, step_px * number], [0, 1, 0]], dtype=np.float64)
        moved.append(cv2.warpAffine(frame, way, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REFLECT))
    return moved


def test_a_camera_that_moved_is_told_and_metres_count_for_less(here, capsys, swing):
    (here / "one.yaml").write_text(yaml.safe_dump({"cameras": [camera("film", 0.0)]}))
    words = ["camera", "track", "film.avi", "--calibration", "one.yaml", "--ball-mm", "60", "-o", "track.csv"]
    sigma_m = []
    for step_px in (0.0, 1.0):
        write_film(here / "film.avi", panned(swing, step_px))
        code, _, err = kendama(capsys, *words)
        assert code == 0, err
        told = [line for line in err.splitlines() if "the camera moved" in line]
        assert len(told) == (step_px > 0)
        sigma_m.append(max(float(row["sigma_x_m"]) for row in rows(here / "track.csv")))
    assert "film.avi: the camera moved: the scene is off by up to 11 px, by more than 3 px in " in told[0]
    assert "metres get larger standard deviations; the detector 'motion' needs one that stands still" in told[0]
    assert sigma_m[1] > 1.5 * sigma_m[0]


def test_images_of_a_camera_that_moved_are_told(here, capsys, swing):
    (here / "images").mkdir()
    for number, image in enumerate(panned(swing[:10], 3.0)):
        cv2.imwrite(str(here / "images" / f"{number:02}.png"), image)
    code, _, err = kendama(capsys, "camera", "detect", "images", "-o", "found.csv")
    assert code == 0, err
    assert "images: the camera moved: the scene is off by up to 1" in err
    assert "put it on a tripod, or teach with --train" in err
