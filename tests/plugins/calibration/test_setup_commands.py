"""setup.yaml from the command line: a light's film, a board on the hand; each command keeps what the others wrote."""

from __future__ import annotations

import csv
import dataclasses
import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from kendama_cli.cli.setup_work import amended
from kendama_cli.config.laboratory import read_setup
from kendama_cli.plugins.calibration.boards import calibration_document
from kendama_cli.plugins.calibration.calibration import CalibratedCamera
from kendama_cli.plugins.calibration.setup import _settings
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.setup import PlacedCamera
from tests.cli.typed import kendama, refused
from tests.plugins.calibration.board_on_hand import board_pose, calibrated, cameras, hands
from tests.plugins.calibration.board_views import BOARD, camera, view
from tests.plugins.calibration.test_latency import DELAY_S, film
from tests.shipped_conf import configured


def write_rows(path: Path, head: list[str], rows) -> None:
    with path.open("w", newline="") as stream:
        csv.writer(stream).writerows([head, *rows])


def write_film(folder: Path, rate_hz: float = 60.0) -> None:
    """A film of 32 x 24 px with the light in its middle, its stamps, and the light's switches; Unix times."""
    blinks, stamps, brightness = film(10000, rate_hz, jitter_s=0.001, lost=0.05)
    writer = cv2.VideoWriter(str(folder / "film.avi"), cv2.VideoWriter_fourcc(*"FFV1"), rate_hz, (32, 24))
    for level in brightness:
        pixels = np.full((24, 32, 3), 60, np.uint8)
        pixels[8:16, 12:20] = round(float(np.clip(level, 0, 255)))
        writer.write(pixels)
    writer.release()
    write_rows(folder / "stamps.csv", ["t_s"], [[f"{1.7e9 + t_s:.6f}"] for t_s in stamps])
    write_rows(folder / "blinks.csv", ["t_s"], [[f"{1.7e9 + t_s:.6f}"] for t_s in blinks.switch_s])


def test_a_filmed_light_tells_the_delay_and_the_setup_keeps_it(here, capsys):
    write_film(here)
    words = ("camera", "latency", "film.avi", "blinks.csv", "--stamps", "stamps.csv", "--region", "12,8,8,8")
    code, out, err = kendama(capsys, *words, "-o", "setup.yaml", "--json")
    assert code == 0, err
    told = json.loads(out)
    assert told["delay_s"] == pytest.approx(DELAY_S, abs=0.0015)
    assert told["low_s"] < told["delay_s"] < told["high_s"]
    kept = read_setup(here / "setup.yaml")
    assert kept.camera_delay_s is not None
    assert kept.camera_delay_s.value == pytest.approx(told["delay_s"], abs=1e-6)
    assert kept.rope_m is None
    code, out, _ = kendama(capsys, "setup", "show")
    assert code == 0
    assert "camera's delay" in out
    code, out, _ = kendama(capsys, "config", "setup=setup.yaml", "camera=device")
    assert yaml.safe_load(out)["camera"]["latency_s"] == kept.camera_delay_s.value


def test_what_is_no_film_of_the_light_is_one_clear_line(here, capsys):
    write_film(here)
    assert "give --stamps FILE" in refused(capsys, "camera", "latency", "film.avi", "blinks.csv")
    corner = ("camera", "latency", "film.avi", "blinks.csv", "--stamps", "stamps.csv", "--region", "0,0,8,8")
    assert "the light explains 0% of the images' brightness" in refused(capsys, *corner)
    assert "reaches beyond the image" in refused(capsys, *corner[:-1], "30,0,8,8")
    assert "give four whole numbers" in refused(capsys, *corner[:-1], "a,b")
    (here / "few.csv").write_text("t_s\n1\n2\n")
    assert "it has 2 stamps, and the film" in refused(capsys, *corner[:-3], "few.csv")
    (here / "wrong.csv").write_text("time\n1\n")
    assert "it has no column 't_s'" in refused(capsys, "camera", "latency", "film.avi", "wrong.csv")
    (here / "back.csv").write_text("t_s\n2\n1\n")
    assert "'t_s' does not rise" in refused(capsys, "camera", "latency", "film.avi", "back.csv")


@pytest.fixture(scope="module")
def held_board(tmp_path_factory):
    """Images of a board on a hand by two cameras, their calibration in a world of its own, and the hand's poses."""
    home, poses, models = tmp_path_factory.mktemp("held"), hands(8, 10003), cameras()
    for model in models:
        (home / model.name).mkdir()
        for number, hand in enumerate(poses):
            cv2.imwrite(str(home / model.name / f"{number}.png"), view(model, board_pose(hand), seed=number))
    nothing = np.zeros(4), (), np.zeros(0), (np.zeros((1, 2)),)
    document = calibration_document(BOARD, [CalibratedCamera(one, *nothing) for one in calibrated(models)])
    (home / "calibration.yaml").write_text(yaml.safe_dump(document))
    turns = Rotation.from_matrix([hand.rotation for hand in poses]).as_quat(scalar_first=True)
    rows = [[number, *hand.place_m, *turn] for number, (hand, turn) in enumerate(zip(poses, turns, strict=True))]
    write_rows(home / "poses.csv", ["view", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"], rows)
    return home


def place_words(home: Path, poses: str = "poses.csv", names: tuple[str, ...] = ("left", "right")) -> tuple[str, ...]:
    files = ("--calibration", str(home / "calibration.yaml"), "--poses", str(home / poses))
    return ("camera", "place", *(str(home / name) for name in names), *files)


def test_a_board_on_the_hand_places_the_cameras_beside_what_the_setup_held(here, capsys, held_board):
    (here / "setup.yaml").write_text("rope_m: {value: 0.41, sigma: 0.001, source: a ruler}\n")
    code, out, err = kendama(capsys, *place_words(held_board))
    assert code == 0, err
    assert "residual" in out
    kept = read_setup(here / "setup.yaml")
    assert kept.rope_m is not None
    assert kept.cameras is not None
    for one, true in zip(kept.cameras, cameras(), strict=True):
        assert one.camera.position_m == pytest.approx(true.position_in_world_m, abs=0.002)
        assert max(one.sigma_m) < 0.002
    code, out, _ = kendama(capsys, "config", "setup=setup.yaml", "camera=device")
    assert yaml.safe_load(out)["transfer"]["observation"]["camera_origin"] == "world"


def test_joint_angles_of_a_robot_place_the_cameras_within_what_is_told(here, capsys):
    """The PA10 turns the board, fixed to its cup, by its last joints; its encoders are off by 0.3 mrad."""
    rng = np.random.default_rng(10007)
    settings = configured(RobotSettings, "robot", "pa10")
    arm = RobotModel(settings, configured(GameSettings, "game", "kendama").cup, 9.81)
    home = np.array(settings.home_rad)
    angles = home + rng.uniform(-1, 1, (14, 7)) * [0.05, 0.05, 0.05, 0.05, 0.4, 0.4, 0.4]
    upright = arm.tool_pose(home).rotation.T
    poses = [arm.tool_pose(one) for one in angles]
    boards = [(pose.rotation @ upright, pose.position_m + pose.rotation @ [0.02, 0.0, 0.08]) for pose in poses]
    middle = np.mean([place for _, place in boards], axis=0)
    models = [
        camera("left", np.add(middle, [-0.15, -0.16, 0.6]), middle),
        camera("right", np.add(middle, [0.17, -0.14, 0.62]), middle),
    ]
    for model in models:
        (here / model.name).mkdir()
        for number, board in enumerate(boards):
            cv2.imwrite(str(here / model.name / f"{number}.png"), view(model, board, seed=number))
    nothing = np.zeros(4), (), np.zeros(0), (np.zeros((1, 2)),)
    document = calibration_document(BOARD, [CalibratedCamera(one, *nothing) for one in calibrated(models)])
    (here / "calibration.yaml").write_text(yaml.safe_dump(document))
    told = angles + 3e-4 * rng.standard_normal(angles.shape)
    write_rows(here / "poses.csv", ["view", *arm.joint_names], [[k, *row] for k, row in enumerate(told.tolist())])
    code, _, err = kendama(capsys, *place_words(here), "--robot", "pa10")
    assert code == 0, err
    kept = read_setup(here / "setup.yaml")
    assert kept.cameras is not None
    for one, true in zip(kept.cameras, models, strict=True):
        off = (np.array(one.camera.position_m) - true.position_in_world_m) / one.sigma_m
        assert np.abs(off).max() < 4, off  # 6 draws of a known sigma pass 4 once in 3000; what is told is known to 30 %
        assert max(one.sigma_m) < 0.002


def test_a_camera_on_a_link_joins_the_fixed_ones_of_the_setup(here, capsys):
    """The PA10's last joints turn a camera on its flange before a board that stands; then a game can read it."""
    rng = np.random.default_rng(10011)
    settings = configured(RobotSettings, "robot", "pa10")
    arm = RobotModel(settings, configured(GameSettings, "game", "kendama").cup, 9.81)
    home = np.array(settings.home_rad)
    angles = home + rng.uniform(-1, 1, (10, 7)) * [0.03, 0.03, 0.03, 0.03, 0.3, 0.3, 0.3]
    links = [arm.link_pose("flange", one) for one in angles]
    at_home = arm.link_pose("flange", home)
    middle = np.add(at_home.position_m, [0.0, 0.0, -0.6])  # the board lies below
    above = dataclasses.replace(camera("right", np.add(at_home.position_m, [0.02, 0.05, 0.0]), middle), name="hand")
    in_link = (
        above.world_to_camera @ at_home.rotation,
        at_home.rotation.T @ (above.position_in_world_m - at_home.position_m),
    )
    model = dataclasses.replace(above, world_to_camera=in_link[0], position_in_world_m=in_link[1])
    (here / "hand").mkdir()
    for number, pose in enumerate(links):
        seen = view(model.carried(pose.rotation, pose.position_m), (np.eye(3), middle), seed=number)
        cv2.imwrite(str(here / "hand" / f"{number}.png"), seen)
    nothing = np.zeros(4), (), np.zeros(0), (np.zeros((1, 2)),)
    document = calibration_document(BOARD, [CalibratedCamera(calibrated([model])[0], *nothing)])
    (here / "calibration.yaml").write_text(yaml.safe_dump(document))
    write_rows(here / "poses.csv", ["view", *arm.joint_names], [[k, *row] for k, row in enumerate(angles.tolist())])
    fixed = PlacedCamera(_settings(camera("left", np.array([0.0, -1.5, 0.3]), middle)), (0.0,) * 3, (0.0,) * 3, "tape")
    amended(here / "setup.yaml", cameras=(fixed,))
    words = ("camera", "place", "hand", "--calibration", "calibration.yaml", "--poses", "poses.csv", "--robot", "pa10")
    code, out, err = kendama(capsys, *words, "--link", "flange")
    assert code == 0, err
    assert "m in link 'flange'" in out
    kept = read_setup(here / "setup.yaml").cameras
    assert kept is not None
    assert [(one.camera.name, one.camera.link) for one in kept] == [("left", None), ("hand", "flange")]
    assert kept[1].camera.position_m == pytest.approx(in_link[1], abs=0.002)
    assert "has no link 'hand'; its links are base, link_s1" in refused(capsys, *words, "--link", "hand")


def test_wrong_poses_are_one_clear_line(here, capsys, held_board):
    lines = (held_board / "poses.csv").read_text().splitlines()
    for name, content, says in (
        ("few.csv", lines[:5], "the board is seen in 4 poses of the hand; needed: 6 or more"),
        ("none.csv", [lines[0]], "no image has a pose"),
        ("twice.csv", [*lines, lines[1]], "gives '0' again"),
        ("broken.csv", [*lines[:3], "9,a,b,c,1,0,0,0"], "line 4 is no pose of the hand"),
        ("long.csv", [*lines[:3], "9,0,0,0,2,0,0,0"], "the length of the quaternion is 2"),
    ):
        (held_board / name).write_text("\n".join(content) + "\n")
        assert says in refused(capsys, *place_words(held_board, name, ("left",)))
    assert not (here / "setup.yaml").exists()
    assert "is no pose of the hand" in refused(capsys, *place_words(held_board, names=("left",)), "--robot", "pa10")


def test_a_setup_has_yamls_ending(here, capsys, held_board):
    assert "a setup is YAML; name it setup.yaml" in refused(capsys, *place_words(held_board), "-o", "setup.txt")


def test_what_a_run_has_measured_of_the_toy_goes_into_the_setup(here, capsys):
    """A pendulum of 0.43 m with quadratic drag, integrated by its angle, as a track that the stage measure reads."""
    rope_m, k2, mass_kg, step_s = 0.43, 0.0006, 0.05, 0.0005
    angle, rate, rows = 1.2, 0.0, []
    for k in range(round(33 / step_s)):
        if k % 34 == 0:
            place = rope_m * np.sin(angle), 0.0, -rope_m * np.cos(angle)
            rows.append([f"{k * step_s:.4f}", *(f"{x:.6f}" for x in place)])
        rate += step_s * (-9.81 / rope_m * np.sin(angle) - k2 / mass_kg * rope_m * abs(rate) * rate)
        angle += step_s * rate
    write_rows(here / "track.csv", ["t_s", "x_m", "y_m", "z_m"], rows)
    assert "no runs in" in refused(capsys, "setup", "kendama")
    code, _, err = kendama(
        capsys, "run", "-p", "measurement", "measure=track", "measure.path=track.csv", "hardware=simulated"
    )
    assert code == 0, err
    code, out, err = kendama(capsys, "setup", "kendama", "-o", "setup.yaml")
    assert code == 0, err
    assert "rope" in out
    kept = read_setup(here / "setup.yaml")
    assert kept.rope_m is not None
    assert kept.rope_m.value == pytest.approx(
        rope_m, abs=0.001
    )  # the rope of the game gives 0.25 to 0.7 mm under the ball
    assert kept.drag is not None
    assert kept.drag.at_3_m_s == pytest.approx(3 * k2, rel=0.05)
