"""`kendama log predict`: what it prints, and what it says of files that it cannot use."""

import dataclasses
import json

import numpy as np
import pytest

from kendama_cli.cli.main import main
from kendama_cli.log.writer import McapLog, MemoryFile
from kendama_cli.stages.predict import STAGE
from kendama_cli.stages.predict.messages import CatchEstimateMessage
from kendama_cli.vision.detection.interface import Sighting, detection_message
from kendama_cli.vision.prediction.release import draw_release
from kendama_cli.vision.prediction.tracker import sphere_centre
from tests.plugins.shared.flight_files import csv_text, qualisys_text
from tests.plugins.shared.flights import session
from tests.vision.scenes import game, predict, shipped_models, virtual

FIGURES = {"position_error_mm_p50", "position_error_mm_p95", "time_error_ms_p50", "time_error_ms_p95"}


@pytest.fixture(scope="module")
def throws(tmp_path_factory):
    track, _ = session(np.random.default_rng(10400), 3)
    path = tmp_path_factory.mktemp("throws") / "throws.csv"
    path.write_text(csv_text(track))
    return path


def test_json_tells_errors_for_every_part_seen(throws, capsys):
    assert main(["log", "predict", str(throws), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    for seen in ("0.3", "0.5", "0.7", "0.9"):
        row = shown[seen]
        assert set(row) >= FIGURES | {"flights"}
        assert row["flights"] == row["predicted"] == 3
        assert 0 <= row["position_error_mm_p50"] <= row["position_error_mm_p95"]
    assert shown["0.7"]["position_error_mm_p50"] < 3
    assert shown["model"]["calibrated_on"] == 3
    assert shown["model"]["gravity_m_s2"] == pytest.approx(9.81, abs=0.15)


def test_stated_uncertainty_is_told_beside_the_errors(throws, capsys):
    assert main(["log", "predict", str(throws), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["0.3"]["position_sigma_mm_p50"] > shown["0.9"]["position_sigma_mm_p50"] > 0
    assert 0 <= shown["0.5"]["inside_95"] <= 1


def test_gravity_that_is_off_by_two_percent_repeated_samples_and_rising_flights_are_told(tmp_path, capsys):
    """Positions 4 % too large; a sample twice; and a throw that is lost before it falls."""
    track, _ = session(np.random.default_rng(10403), 3)
    rising = np.arange(0.0, 0.4, 1 / 120)
    thrown = np.column_stack([rising, 0 * rising, 5.0 * rising - 9.81 / 2 * rising**2])
    t_s, points = np.concatenate([track.t_s, track.t_s[-1] + 1 + rising]), np.concatenate([track.position_m, thrown])
    lines = csv_text(type(track)("ball", t_s, 1.04 * points)).splitlines()
    (tmp_path / "a.csv").write_text("\n".join([*lines[:40], lines[39], *lines[40:]]))
    assert main(["log", "predict", str(tmp_path / "a.csv"), "--json"]) == 0
    shown = capsys.readouterr()
    assert json.loads(shown.out)["flights"] == 3
    assert "1 samples have the time of the one before; left out" in shown.err
    assert "1 flights end before the ball falls; left out" in shown.err
    assert "the flights' gravity is +4." in shown.err or "the flights' gravity is +3." in shown.err
    assert "0." in shown.err.split("in size and")[1]


def test_the_noise_of_a_detector_is_learned_from_a_log_of_flights_that_cameras_saw(tmp_path, capsys):
    """Detections with 0.2 px of noise of which 0.4 px is stated; three standard deviations of 6 flights are 0.1."""
    log = tmp_path / "predict.mcap"
    detected_log(log, flights=6, sigma_px=0.2, stated_px=0.4)
    assert main(["log", "predict", str(log), "--json"]) == 0
    motion = json.loads(capsys.readouterr().out)["motion"]
    assert motion["noise_scale"] == pytest.approx(0.5, abs=0.1)
    assert motion["sigma_m"] < 1e-3
    detected_log(log, flights=3, sigma_px=0.2, stated_px=0.4)
    assert main(["log", "predict", str(log)]) == 2
    assert "3 flights with 12 detections; 5 are needed" in capsys.readouterr().err


def test_each_logs_flights_fall_in_its_own_game(tmp_path, capsys):
    """In the other log's gravity the second log's ball would be a meter off, and all of it wobble."""
    logs = [tmp_path / "earth.mcap", tmp_path / "mars.mcap"]
    for log, gravity_m_s2 in zip(logs, (9.81, 3.7), strict=True):
        detected_log(log, flights=3, sigma_px=0.2, stated_px=0.4, gravity_m_s2=gravity_m_s2)
    assert main(["log", "predict", *map(str, logs), "--json"]) == 0
    motion = json.loads(capsys.readouterr().out)["motion"]
    assert motion["noise_scale"] == pytest.approx(0.5, abs=0.1)
    assert motion["sigma_m"] < 1e-3


def detected_log(path, *, flights, sigma_px, stated_px, gravity_m_s2=9.81):
    """A log as predict writes it, of flights that two cameras see with drawn noise."""
    rng, log = np.random.default_rng(10404), McapLog(STAGE.topics, MemoryFile())
    played = dataclasses.replace(game(), gravity_m_s2=gravity_m_s2)
    cameras = {model.name: model for model in shipped_models()}
    for flight in range(flights):
        release, begin = draw_release(rng, predict().release, played, 0.1), 2.0 * flight
        pose = CatchEstimateMessage(flight, begin + release.crossing_s, *np.zeros(10).tolist())
        log.write("/predict/estimate", begin, pose)
        for t in np.arange(0.0, release.crossing_s, 1 / 40):
            for name, model in cameras.items():
                ball = release.ball_m(t)
                centre, radius = model.project(ball)[0], model.size_px(ball, game().ball.radius_m)
                disc = 2 * centre - sphere_centre(model, centre, radius) + sigma_px * rng.standard_normal(2)
                seen = Sighting(disc, stated_px**2 * np.eye(2), radius, 1.0)
                log.write("/predict/detection", begin + t, detection_message(flight, name, seen))
    nodes = {"predict": predict(), "camera": virtual(), "game": played}
    facts = {name: dataclasses.asdict(node) for name, node in nodes.items()}
    log.finish(path, stage="predict", settings=facts, metrics={})


def test_other_files_calibrate_it(throws, tmp_path, capsys):
    track, _ = session(np.random.default_rng(10401), 2, rate_hz=200.0)
    even = type(track)("ball", np.arange(len(track.t_s)) / 200, track.position_m)
    (tmp_path / "others.tsv").write_text(qualisys_text(even, 200.0))
    assert main(["log", "predict", str(throws), "--calibrate", str(tmp_path / "others.tsv")]) == 0
    text = capsys.readouterr().out
    assert "3 flights" in text
    assert "the flights named by --calibrate" in text
    assert "calibrated_on 2" in text
    assert len(text.splitlines()) == 6


def test_a_single_flight_is_held_against_standard_gravity(tmp_path, capsys):
    track, _ = session(np.random.default_rng(10402), 1)
    (tmp_path / "one.csv").write_text(csv_text(track))
    assert main(["log", "predict", str(tmp_path / "one.csv"), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["model"]["calibrated_on"] == 0
    assert shown["0.5"]["position_error_mm_p50"] < 10


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "t_s,x_m,y_m,z_m\n" + "".join(f"{i / 100},0,0,1\n" for i in range(200)),
            "no free flight in its only track: none falls",
        ),
        ("a,b\n1,2\n", "its header lacks t_s, x_m, y_m, z_m"),
        ("t_s;x_m;y_m;z_m\n0,1;0;0;1\n", "no free flight in its only track: none falls"),
    ],
)
def test_a_file_without_a_flight_is_told_in_one_line(tmp_path, capsys, text, message):
    (tmp_path / "a.csv").write_text(text)
    assert main(["log", "predict", str(tmp_path / "a.csv")]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.splitlines()) == 1
    assert message in shown.err


def test_files_of_one_throw_each_count_as_one_recording(tmp_path, capsys):
    names = []
    for number in range(4):
        track, _ = session(np.random.default_rng(10410 + number), 1)
        names.append(str(tmp_path / f"{number}.csv"))
        (tmp_path / f"{number}.csv").write_text(csv_text(track))
    still = "t_s,x_m,y_m,z_m\n" + "".join(f"{i / 100},0,0,1\n" for i in range(200))
    (tmp_path / "still.csv").write_text(still)
    assert main(["log", "predict", *names, str(tmp_path / "still.csv"), "--json"]) == 0
    shown = capsys.readouterr()
    document = json.loads(shown.out)
    assert document["flights"] == document["0.5"]["predicted"] == document["model"]["calibrated_on"] == 4
    assert "still.csv: no free flight" in shown.err


def refused(capsys, *words):
    assert main(["log", "predict", *map(str, words)]) == 2
    shown = capsys.readouterr()
    (line,) = shown.err.splitlines()
    return line


def test_a_file_that_is_given_twice_is_refused(throws, tmp_path, capsys):
    assert "throws.csv: it is given twice, so its flights would count twice" in refused(capsys, throws, throws)
    copy = tmp_path / "copy.csv"
    copy.write_bytes(throws.read_bytes())
    line = refused(capsys, throws, copy)
    assert f"copy.csv: it is a copy of {throws}, so its flights would count twice; leave out one of the two" in line
    line = refused(capsys, throws, "--calibrate", throws)
    assert f"--calibrate {throws}: it is among the files to predict, so flights would be predicted from" in line
    assert f"--calibrate {copy}: it is a copy of {throws}" in refused(capsys, throws, "--calibrate", copy)


def test_files_without_a_flight_are_counted(tmp_path, capsys):
    for number in (1, 2):
        still = "t_s,x_m,y_m,z_m\n" + "".join(f"{i / 100},0,0,{number}\n" for i in range(200))
        (tmp_path / f"{number}.csv").write_text(still)
    line = refused(capsys, tmp_path / "1.csv", tmp_path / "2.csv")
    assert "no free flight in the 2 tracks of 2 files" in line
    assert "record balls that are thrown up and fall, in metres and seconds, z up" in line
