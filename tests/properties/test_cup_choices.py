"""Every bundled cup, arm and camera: report, renderer and safety check take the cup where DART has it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.devices.camera.calibration import camera_model
from kendama_cli.devices.camera.virtual import VirtualCameraBlock
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.rendering.scene import ScenePose
from kendama_cli.report.tracks import Path2D, catch_time_s, cup_outline_m
from kendama_cli.robot_model.arm_scene import cup_solid
from kendama_cli.robot_model.cup import attach_cup
from kendama_cli.robot_model.dart_library import dartpy
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.motion_check import check_motion
from kendama_cli.schema.settings import build
from kendama_cli.settings.camera import LightingSettings, VirtualCamera
from kendama_cli.settings.game import CupSettings, GameSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.safety import SafetySettings
from tests.extras import require_robot_descriptions
from tests.shipped_conf import CONF, plain

CUPS = sorted(one.stem for one in (CONF / "game/cup").glob("*.yaml"))
ARMS = sorted(one.stem for one in (CONF / "robot").glob("*.yaml") if one.stem != "urdf")
RIGS = sorted(one.stem for one in (CONF / "camera/rig").glob("*.yaml"))
GAME = build(GameSettings, plain("game", "kendama"), "game")


def game_with(cup: str) -> GameSettings:
    return dataclasses.replace(GAME, cup=build(CupSettings, plain("game/cup", cup), "cup"))


def simulated_corners(cup: CupSettings) -> np.ndarray:
    """Corners (n, 3) of the staves' boxes and of the handle as DART has them, in the cup's frame."""
    skeleton = dartpy.dynamics.Skeleton("holder")
    _, holder = skeleton.createWeldJointAndBodyNodePair()
    body, _ = attach_cup(skeleton, holder, dartpy.math.Isometry3(), cup)
    found = []
    for node in body.getShapeNodes():
        shape, place = node.getShape(), node.getRelativeTransform()
        if isinstance(shape, dartpy.dynamics.BoxShape):
            half = np.array(shape.getSize()) / 2
        else:
            half = np.array([0.0, 0.0, shape.getHeight() / 2])
        signs = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
        found.append((signs * half) @ place.rotation().T + place.translation())
    return np.vstack(found)


@pytest.mark.parametrize("cup", CUPS)
def test_the_report_marks_the_catch_and_draws_the_cup_where_it_was_simulated(cup: str) -> None:
    settings = game_with(cup).cup
    rim_m, foot_m = np.ptp(simulated_corners(settings)[:, 2]), simulated_corners(settings)[:, 2].min()
    assert foot_m == pytest.approx(0.0, abs=1e-12)
    drawn = cup_outline_m(settings)[:, 1], np.array(cup_solid(settings).vertices_m)[:, 2]
    for heights in drawn:
        assert heights.max() == pytest.approx(rim_m)
        assert heights.min() == 0.0
    t = np.linspace(0, 2, 2001)
    ball = Path2D(t, 0.02 + 0 * t, rim_m + 0.3 - 9.81 / 2 * (t - 1) ** 2, 0 * t)
    still = Path2D(t, 0 * t, 0 * t, 0 * t)
    assert catch_time_s(still, ball, settings) == pytest.approx(1 + math.sqrt(0.6 / 9.81), abs=1e-3)


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("cup", CUPS)
def test_the_safety_check_keeps_the_whole_cup_off_the_table(cup: str, arm: str) -> None:
    """However the cup is turned: the gap is from the table to the tie, less the farthest corner that DART has."""
    game = game_with(cup)
    values = plain("robot", arm)
    if values["path"].startswith("package:"):
        require_robot_descriptions()
    robot = resolve_files(build(RobotSettings, values, "robot"), "robot", [CONF.parent])
    model = RobotModel(robot, game.cup, game.gravity_m_s2)
    safety = build(SafetySettings, plain("safety", "default"), "safety")
    home = np.tile(model.home_rad, (3, 1))
    tie_m = model.tool_position_m(model.home_rad)
    farthest = float(np.linalg.norm(simulated_corners(game.cup)[:, [0, 2]], axis=1).max())
    table_m = float(tie_m[2]) - farthest - 0.5 * safety.gap_m
    joints = JointTrajectory(model.joint_names, np.array([0.0, 0.01, 0.02]), home, 0 * home, 0 * home)
    checked = check_motion(model, game, joints, dataclasses.replace(safety, table_height_m=table_m))
    assert not next(one for one in checked if one.what == "table").holds


def _image(cup_m: np.ndarray, turn: np.ndarray, game: GameSettings, rig: str, number: int) -> np.ndarray:
    none = np.empty((0, 3))
    pose = ScenePose(ball_m=np.array([0.0, 0.0, -50.0]), cup_m=cup_m, cup_rotation=turn, rope_m=none, arm_m=none)
    settings = build(VirtualCamera, plain("camera", "virtual") | plain("camera/rig", rig), "camera")
    light = build(LightingSettings, plain("lighting", "bright"), "lighting")
    camera = VirtualCameraBlock(
        camera_model(settings.cameras[number]),
        settings,
        game,
        light,
        scene=lambda t_s: pose,
        clock=lambda: 1.0,
        rng=np.random.default_rng(10000),
    )
    return camera.latest(max_age_s=1.0).pixels.astype(float)


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("cup", CUPS)
@pytest.mark.parametrize("tilt_rad", [0.0, 0.4])
def test_a_camera_sees_the_cup_where_it_was_simulated(cup: str, rig: str, tilt_rad: float) -> None:
    """From the topmost to the lowest pixel: as the corners of DART's staves and of its handle project, within 4 px."""
    game = game_with(cup)
    turn = np.array(
        [[math.cos(tilt_rad), 0, math.sin(tilt_rad)], [0, 1, 0], [-math.sin(tilt_rad), 0, math.cos(tilt_rad)]]
    )
    settings = build(VirtualCamera, plain("camera", "virtual") | plain("camera/rig", rig), "camera")
    at, away = np.array([0.0, 0.0, 0.1]), np.array([0.0, 0.0, -50.0])
    for number, one in enumerate(settings.cameras):
        if one.link is not None:
            continue  # tests/devices/camera/test_on_a_link.py
        seen = _image(at, turn, game, rig, number) - _image(away, turn, game, rig, number)
        rows = np.flatnonzero((np.abs(seen).max(axis=2) > 60).sum(axis=1) > 1)
        corners = camera_model(one).project(at + simulated_corners(game.cup) @ turn.T)
        assert rows[0] == pytest.approx(corners[:, 1].min(), abs=4)
        assert rows[-1] == pytest.approx(corners[:, 1].max(), abs=4)
