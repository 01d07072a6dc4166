"""kendama camera track --readout: rolling shutters told by the ball's own flights in drawn films."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
import yaml

from kendama_cli.devices.camera.calibration import camera_model, read_calibration
from tests.cli.typed import kendama, refused
from tests.vision.ball_films import RATE_HZ, pendulum, textured, write_film
from tests.vision.rolling import draw, throws

READOUT_S = {"left": 0.024, "right": 0.0}
BOTH = ["camera", "track", "left.avi", "right.avi", "--calibration", "both.yaml", "--same-clock"]


def entry(name, x_m):
    return {
        "name": name, "width_px": 320, "height_px": 240, "focal_px": [300.0, 300.0], "center_px": [159.5, 119.5],
        "distortion": [0.0] * 5, "position_m": [x_m, -1.5, 0.1], "look_at_m": [0.0, 0.0, 0.1], "rotation_wxyz": None,
    }  # fmt: skip


def films(here, count):
    """Throws before a rolling and a global shutter."""
    made = throws(np.random.default_rng(10650), count, (2.0, 2.6))
    (here / "both.yaml").write_text(yaml.safe_dump({"cameras": [entry("left", -0.3), entry("right", 0.3)]}))
    for one in read_calibration(str(here / "both.yaml")):
        camera, rng = replace(camera_model(one), readout_s=READOUT_S[one.name]), np.random.default_rng(10651)
        frames = []
        for frame in range(int(made.end_s * RATE_HZ)):
            image = draw(np.full((240, 320, 3), 170.0), camera, made.ball_m, frame / RATE_HZ, 45.0)
            frames.append(np.clip(image + rng.normal(0, 2, image.shape), 0, 255).astype(np.uint8))
        write_film(here / f"{one.name}.avi", frames)
    return made


def off_mm(path, made):
    """Distances of the track from the ball, in flight."""
    with path.open(newline="") as file:
        found = [[float(row[name]) for name in ("t_s", "x_m", "y_m", "z_m")] for row in csv.DictReader(file)]
    flying = [
        one
        for one in found
        if any(a + 0.05 < one[0] < a + b - 0.05 for a, b in zip(made.begin_s, made.flown_s, strict=True))
    ]
    return 1e3 * np.array([np.linalg.norm(one[1:] - made.ball_m(one[0])) for one in flying])


def test_a_rolling_and_a_global_shutter_are_told_apart_and_the_readout_is_given_back(here, capsys):
    made = films(here, 6)
    code, out, err = kendama(capsys, *BOTH, "--readout", "rolling.yaml", "-o", "throws.csv")
    assert code == 0, err
    assert "left: a rolling shutter, its readout is 2" in out
    assert "right: as of a global shutter, its readout is " in out
    assert "ms (95 %), by 6 flights" in out
    left, right = read_calibration(str(here / "rolling.yaml"))
    assert left.readout_s == pytest.approx(0.024, abs=0.003)
    assert right.readout_s == 0
    assert replace(left, readout_s=0.0) == read_calibration(str(here / "both.yaml"))[0]
    again = [word.replace("both", "rolling") for word in BOTH]
    code, _, err = kendama(capsys, *again, "-o", "again.csv")
    assert code == 0, err
    assert np.median(off_mm(here / "again.csv", made)) == pytest.approx(
        np.median(off_mm(here / "throws.csv", made)), abs=0.1
    )
    assert kendama(capsys, *BOTH, "-o", "ignored.csv")[0] == 0
    assert np.median(off_mm(here / "throws.csv", made)) < np.median(off_mm(here / "ignored.csv", made)) / 3


def test_one_camera_that_cannot_tell_says_so_and_keeps_what_the_calibration_says(here, capsys):
    films(here, 1)
    words = ["camera", "track", "left.avi", "--calibration", "both.yaml", "--ball-mm", "60", "--readout", "one.yaml"]
    code, out, err = kendama(capsys, *words, "--json")
    assert code == 0, err
    told = json.loads(out)["readout"]["left"]
    low_s, high_s = told["interval_s"]
    assert high_s - low_s > 0.016
    assert low_s < 0.024 < high_s
    assert told["set_s"] is None
    assert read_calibration(str(here / "one.yaml"))[0].readout_s == 0.0


def test_what_cannot_be_is_one_line(here, capsys):
    (here / "both.yaml").write_text(yaml.safe_dump({"cameras": [entry("left", -0.3)]}))
    write_film(here / "left.avi", pendulum(60, 10652, background=textured(10652))[0])
    line = refused(capsys, "camera", "track", "left.avi", "--readout", "r.yaml")
    assert "--readout: flights tell it in metres; add --calibration" in line
    words = ["camera", "track", "left.avi", "--calibration", "both.yaml", "--ball-mm", "60", "--readout"]
    assert "--readout r.txt: a calibration is YAML; name it r.yaml" in refused(capsys, *words, "r.txt")
    assert "no free flight is seen: throw the ball up and catch it" in refused(capsys, *words, "r.yaml")
    assert not (here / "r.yaml").exists()
    (here / "both.yaml").write_text(yaml.safe_dump({"cameras": [entry("left", -0.3) | {"readout_s": 24.0}]}))
    assert "'cameras.0.readout_s' is 24.0; allowed: at least -0.1" in refused(capsys, *words, "r.yaml")
