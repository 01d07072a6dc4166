"""kendama camera track on films that are damaged, turned or do not fit: told in one line, never a wrong track."""

import numpy as np
import pytest
import yaml

from tests.cli.typed import kendama, refused
from tests.plugins.films.test_detect import boxes_at, camera, rows
from tests.plugins.shared.test_video import turn, turn_on_its_side
from tests.vision.ball_films import pendulum, textured, write_film

pytestmark = pytest.mark.usefixtures("quick_training")


@pytest.fixture(scope="module")
def swing():
    return pendulum(24, 10320, background=textured(10321))


def test_a_damaged_film_is_tracked_up_to_the_damage_and_that_is_told(here, capsys, swing):
    frames, truth = swing
    write_film(here / "swing.avi", frames)
    data = bytearray((here / "swing.avi").read_bytes())
    middle = len(data) // 2
    data[middle : middle + 30_000] = bytes(30_000)
    (here / "swing.avi").write_bytes(data)
    code, _, err = kendama(capsys, "camera", "track", "swing.avi", "-o", "swing.csv", *boxes_at(truth, 7, (1, 4, 7)))
    assert code == 0, err
    (line,) = [line for line in err.splitlines() if "damaged" in line]
    assert "of its 24 frames; an AVI does not say when a frame was taken" in line
    assert 6 <= len(rows(here / "swing.csv")) <= 14


def test_a_turned_film_is_refused_where_lines_or_size_matter(here, capsys, swing):
    write_film(here / "film.mp4", swing[0], "mp4v")
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


def test_a_film_without_a_ball_gives_no_track_but_one_line(here, capsys):
    rng, wall = np.random.default_rng(10322), textured(10323)
    write_film(
        here / "wall.mp4", [(wall + rng.normal(0, 6, wall.shape)).clip(0, 255).astype(np.uint8) for _ in range(40)]
    )
    code, out, err = kendama(capsys, "camera", "track", "wall.mp4", "-o", "wall.csv", "--detector", "colour")
    assert (code, out) == (1, "")
    (line,) = [line for line in err.splitlines() if "no ball found" in line]
    assert "it is seen in no frame" in line
    assert "--box FRAME:X,Y,W,H" in line
    assert not (here / "wall.csv").exists()
