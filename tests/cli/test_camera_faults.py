"""kendama camera track on films that are damaged, turned or do not fit: told in one line, never a wrong track."""

import pytest
import yaml

from tests.cli.test_camera_seeing import camera, rows
from tests.cli.typed import kendama, refused
from tests.devices.camera.test_film import turn_on_its_side
from tests.vision.ball_films import pendulum, textured, write_film


@pytest.fixture(scope="module")
def swing():
    return pendulum(30, 10320, background=textured(10321))[0]


def test_a_damaged_film_is_tracked_up_to_the_damage_and_that_is_told(here, capsys, swing):
    write_film(here / "swing.avi", swing)
    data = bytearray((here / "swing.avi").read_bytes())
    middle = len(data) // 2
    data[middle : middle + 30_000] = bytes(30_000)
    (here / "swing.avi").write_bytes(data)
    code, _, err = kendama(capsys, "camera", "track", "swing.avi", "-o", "swing.csv")
    assert code == 0, err
    (line,) = [line for line in err.splitlines() if "damaged" in line]
    assert "of its 30 frames; an AVI does not say when a frame was taken" in line
    assert 8 <= len(rows(here / "swing.csv")) <= 16


def test_a_turned_film_is_refused_where_lines_or_size_matter(here, capsys, swing):
    write_film(here / "film.mp4", swing, "mp4v")
    turn_on_its_side(here / "film.mp4")
    words = ["camera", "track", "film.mp4", "--ball-mm", "60", "--calibration", "one.yaml"]
    (here / "one.yaml").write_text(yaml.safe_dump({"cameras": [camera("film", 0.0)]}))
    line = refused(capsys, *words)
    assert "it has 240 x 320 px, turned by " in line
    assert "as its metadata says, but camera 'film' was calibrated with 320 x 240 px" in line
    upright = camera("film", 0.0, (240, 320)) | {"center_px": [119.5, 159.5]}
    (here / "one.yaml").write_text(yaml.safe_dump({"cameras": [upright]}))
    assert "so its shutter's lines are columns; film with the camera level" in refused(
        capsys, *words, "--readout", "r.yaml"
    )
