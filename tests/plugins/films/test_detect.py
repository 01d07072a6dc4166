"""kendama camera train, detect and track: from a person's own images and films to sightings and a track."""

import csv
import json
import shutil

import cv2
import numpy as np
import pytest
import yaml

from kendama_cli.cli import main
from kendama_cli.devices.camera.calibration import camera_model, read_calibration
from kendama_cli.plugins.shared.recordings.reader import read_tracks
from kendama_cli.plugins.suites.detector import disc_image
from tests.cli.typed import kendama, refused
from tests.vision.ball_films import RATE_HZ, WIDTH, draw_ball, pendulum, textured, write_film, write_labelled

pytestmark = pytest.mark.usefixtures("quick_training")


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def labelled(tmp_path_factory):
    home = tmp_path_factory.mktemp("labelled")
    write_labelled(home / "one", range(10000, 10001))
    write_labelled(home / "taught", range(10000, 10004))
    boxes = write_labelled(home / "others", range(10100, 10112), without=(10103, 10107))
    return home, boxes


def test_a_taught_ball_is_found_and_scored_against_boxes(here, capsys, labelled):
    home, boxes = labelled
    words = ["camera", "detect", str(home / "others"), "--train", str(home / "taught"), "-o", "found.csv"]
    code, out, err = kendama(capsys, *words, "--score", str(home / "others" / "labels"), "--json")
    assert code == 0, err
    found = rows(here / "found.csv")
    assert list(found[0]) == ["file", "u_px", "v_px", "radius_px", "score"]
    hits = 0
    for row in found:
        box = boxes[row["file"].rsplit("/", 1)[-1].removesuffix(".png")]
        hits += box is not None and np.hypot(float(row["u_px"]) - box[0], float(row["v_px"]) - box[1]) < box[2] / 2
    document = json.loads(out)
    assert document["hits"] == hits
    assert document["boxes"] == 10
    assert document["recall"] == hits / 10 >= 0.9
    assert document["precision"] == hits / len(found) >= 0.9


def test_a_ball_is_taught_once_and_used_by_name(here, capsys, labelled):
    home, _ = labelled
    code, out, err = kendama(capsys, "camera", "train", str(home / "taught"), "-o", "mine.npz")
    assert code == 0, err
    assert "predict/detector=trained predict.detector.ball=mine.npz" in out
    assert (here / "mine.npz").stat().st_size > 1000


def test_one_box_teaches_a_ball_but_is_told_to_be_few(here, capsys, labelled):
    code, _, err = kendama(capsys, "camera", "train", str(labelled[0] / "one"), "-o", "mine.npz")
    assert code == 0, err
    assert "1 box teaches the ball: with 3 to 10 it is found more often, and a wrong one is noticed" in err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["camera", "detect", "images"], "what was not finished is not kept, the same command begins anew"),
        (["run", "-p", "measurement"], "what was finished is kept, the same command goes on from there"),
    ],
)
def test_an_interruption_says_whether_the_command_goes_on(here, capsys, monkeypatch, words, told):
    def interrupted(arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(main, "_carry_out", interrupted)
    code, _, err = kendama(capsys, *words)
    assert code == main.INTERRUPTED
    assert err == f"kendama: interrupted; {told}\n"


def boxes_at(places, radius_px, frames):
    """Options that teach the ball by boxes about it in ``frames``."""
    return [
        f"--box={k}:{places[k][0] - radius_px:.0f},{places[k][1] - radius_px:.0f},{2 * radius_px},{2 * radius_px}"
        for k in frames
    ]


@pytest.mark.parametrize("quick_training", ["quick", pytest.param("whole", marks=pytest.mark.slow)], indirect=True)
def test_a_film_of_a_ball_on_a_string_is_tracked_by_five_boxes(here, capsys):
    frames, truth = pendulum(50, 10010, background=textured(10011))
    write_film(here / "swing.avi", frames)
    boxes = boxes_at(truth, 7, (5, 15, 25, 35, 45))
    code, out, err = kendama(
        capsys, "camera", "track", "swing.avi", "-o", "swing.csv", "--overlay", "seen.webm", *boxes
    )
    assert code == 0, err
    assert "in pixels: give --calibration" in out
    found = rows(here / "swing.csv")
    off = [
        np.hypot(float(r["u_px"]) - truth[int(r["frame"])][0], float(r["v_px"]) - truth[int(r["frame"])][1])
        for r in found
    ]
    assert len(found) >= 0.97 * len(truth)
    assert np.mean(np.array(off) < 7) >= 0.99
    assert (here / "seen.webm").stat().st_size > 10_000


def test_without_boxes_the_one_line_says_how_to_draw_them(here, capsys):
    write_film(here / "swing.avi", pendulum(5, 1, background=textured(2))[0])
    line = refused(capsys, "camera", "track", "swing.avi")
    assert "nobody has shown the ball" in line
    assert "by 'kendama camera train FILM'" in line
    assert "--box FRAME:X,Y,W,H" in line


def camera(name, x_m, size=(WIDTH, 240)):
    return {
        "name": name,
        "width_px": size[0],
        "height_px": size[1],
        "focal_px": [300.0, 300.0],
        "center_px": [159.5, 119.5],
        "distortion": [0.0] * 5,
        "position_m": [x_m, -1.5, 0.0],
        "look_at_m": [0.0, 0.0, 0.0],
        "rotation_wxyz": None,
    }


def test_two_calibrated_films_with_clocks_of_their_own_give_metres_and_the_offset(here, capsys):
    """A thrown ball, seen by two cameras of which the second's film begins 3.4 frames later."""
    (here / "both.yaml").write_text(yaml.safe_dump({"cameras": [camera("left", -0.4), camera("right", 0.4)]}))
    models = [camera_model(one) for one in read_calibration(str(here / "both.yaml"))]
    start, speed = np.array([-0.3, 0.1, -0.25]), np.array([0.5, -0.1, 2.4])

    def place(t_s):
        return start + speed * t_s - np.array([0, 0, 9.81]) * t_s**2 / 2

    late_s = 3.4 / RATE_HZ
    for model, begin_s in zip(models, (0.0, late_s), strict=True):
        rng = np.random.default_rng(10012)
        frames = []
        for frame in range(40):  # it flies half a second, and lies out of the image before and after
            t_s = frame / RATE_HZ + begin_s - 0.5
            image = np.full((240, 320, 3), 170, dtype=np.uint8)
            pixel = model.project(place(t_s))[0]
            if 0 <= t_s <= 0.5:
                draw_ball(image, pixel, 300 * 0.03 / float(model.depth_m(place(t_s))), (25, 30, 190))
            frames.append(np.clip(image + rng.normal(0, 2, image.shape), 0, 255).astype(np.uint8))
        write_film(here / f"{model.name}.avi", frames)
    words = ["camera", "track", "left.avi", "right.avi", "--calibration", "both.yaml", "--detector", "colour"]
    code, out, err = kendama(capsys, *words, "-o", "throw.csv", "--json")
    assert code == 0, err
    offset_s = json.loads(out)["offset_s"]["right"]
    assert offset_s == pytest.approx(-late_s, abs=0.003)
    found = rows(here / "throw.csv")
    off = [
        np.linalg.norm(np.array([float(r[f"{axis}_m"]) for axis in "xyz"]) - place(float(r["t_s"]) - 0.5))
        for r in found
    ]
    assert len(found) >= 9
    assert np.median(off) < 0.01
    sigma = np.array([[float(r[f"sigma_{axis}_m"]) for axis in "xyz"] for r in found])
    assert 0 < sigma.min() < sigma.max() < 0.05
    code, out, err = kendama(capsys, *words, "-o", "again.csv")
    assert "rays usually miss each other by" in out
    assert code == 0, err
    (track,) = read_tracks(here / "again.csv")
    assert np.allclose(track.position_m, [[float(r[f"{axis}_m"]) for axis in "xyz"] for r in found], atol=1e-6)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["camera", "detect", "nowhere"], "no such file or folder"),
        (["camera", "detect", "empty"], "it holds no image"),
        (["camera", "train", "images"], "has a file of boxes"),
        (["camera", "detect", "images"], "nobody has shown the ball"),
        (["camera", "track", "nowhere.mp4"], "no such video"),
        (["camera", "track", "text.mp4"], "OpenCV cannot read it as a video"),
        (["camera", "track", "film.avi", "--box", "3"], "give a frame and the box in it"),
        (["camera", "track", "film.avi", "--box", "3:310,10,30,30"], "lies outside of the film"),
        (["camera", "track", "film.avi", "--box", "900:10,10,30,30"], "has no frame 900; its frames are 0 to 4"),
        (["camera", "track", "film.avi", "--box", "-1:10,10,30,30"], "has no frame -1"),
        (["camera", "track", "no.avi", "--box", "3:10,10,0,30"], "--box 3:10,10,0,30: width and height are more than"),
        (["camera", "track", "no.avi", "--box", "3:10,ten,30,30"], "--box 3:10,ten,30,30: give a frame and the box"),
        (["camera", "track", "no.avi", "--box", "3:nan,10,30,30"], "--box 3:nan,10,30,30: width and height"),
        (["camera", "track", "film.avi", "--train", "bad"], "bad/labels/b.txt, line 2: '0 0.5 0.5 0.1' has 4 columns"),
        (["camera", "detect", "images", "--score", "bad/labels"], "no file of boxes in it has an image's name"),
        (["camera", "detect", "bad", "--score", "bad/labels"], "bad/labels/b.txt, line 2: '0 0.5 0.5 0.1' has 4"),
        (["camera", "track", "film.avi", "film.avi"], "two films are called"),
        (["camera", "track", "film.avi", "--calibration", "other.yaml", "--ball-mm", "60"], "was calibrated with"),
        (
            ["camera", "track", "film.avi", "-o", "track.xlsx"],
            "a track is a CSV; name it track.csv",
        ),
        (["camera", "detect", "images", "--detector", "nothing"], "nothing"),
    ],
)
def test_what_cannot_be_seen_is_refused_in_one_line(here, capsys, labelled, words, message):
    (here / "empty").mkdir()
    (here / "images").mkdir()
    shutil.copy(next((labelled[0] / "others" / "images").iterdir()), here / "images")
    (here / "text.mp4").write_text("no film")
    (here / "bad" / "images").mkdir(parents=True)
    (here / "bad" / "labels").mkdir()
    cv2.imwrite(str(here / "bad" / "images" / "b.png"), disc_image())
    (here / "bad" / "labels" / "b.txt").write_text("0 0.5 0.5 0.1 0.1\n0 0.5 0.5 0.1\n")
    (here / "other.yaml").write_text(yaml.safe_dump({"cameras": [camera("film", 0.0, (640, 480))]}))
    write_film(here / "film.avi", pendulum(5, 1, background=textured(2))[0])
    code, _, err = kendama(capsys, *words)
    assert code in (1, 2)
    assert message in err
    assert len(err.strip().splitlines()) == 1
