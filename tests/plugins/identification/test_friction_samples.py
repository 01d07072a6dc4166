"""The friction that nobody modelled is found in what the sensors tell, and compensated."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import yaml

from kendama_cli.artifacts.friction_model import FrictionModel, NetworkFriction, ParametricFriction
from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.devices.robot.compensated import CompensatedRobot, compensated
from kendama_cli.devices.robot.simulated import SimulatedRobot
from kendama_cli.errors import HardwareError, StageError
from kendama_cli.plugins.identification.excitation import excitation
from kendama_cli.plugins.identification.friction_choice import fit_parametric
from kendama_cli.plugins.identification.friction_samples import Samples
from kendama_cli.plugins.identification.recording import JointRecording, play
from kendama_cli.plugins.identification.settings import IdentifySettings
from kendama_cli.robot_model.friction import parametric_torque
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings
from tests.devices.robot.stand_in import ObedientRobot, command
from tests.devices.robot.test_simulated import PERFECT
from tests.simulation.dart.bench_robot import bench_arm, kendama_game

SHIPPED = build(
    IdentifySettings,
    yaml.safe_load((Path(__file__).parents[3] / "conf/identify/sweep.yaml").read_text()),
    "identify",
)
GAME = kendama_game()


def recorded(
    robot: RobotSettings, duration_s: float = 12.0, game: GameSettings = GAME, **imperfection: float
) -> JointRecording:
    arm = RobotModel(robot, game.cup, game.gravity_m_s2)
    body = SimulatedRobot(
        robot, game, imperfection=dataclasses.replace(PERFECT, **imperfection), control_period_s=0.004
    )
    return play(
        body,
        excitation(arm, game, SHIPPED, duration_s=duration_s, period_s=body.period_s, rng=np.random.default_rng(8)),
        1,
    )


def found(robot: RobotSettings, recording: JointRecording, game: GameSettings = GAME) -> ParametricFriction:
    samples = Samples(robot, game).of(recording, SHIPPED.smoothing_s)
    return fit_parametric(samples.velocity_rad_s, samples.torque_nm, samples.kept)


@pytest.fixture(scope="module")
def worn() -> JointRecording:
    return recorded(bench_arm(), joint_friction_nm=0.5)


def test_unknown_coulomb_friction_is_found_beside_the_known_one_and_the_swinging_ball(worn: JointRecording) -> None:
    friction = found(bench_arm(), worn)
    assert friction.coulomb_nm == pytest.approx(np.full(7, 0.5), abs=0.05)
    assert friction.offset_nm == pytest.approx(np.zeros(7), abs=0.02)


def test_an_arm_that_has_no_more_friction_than_is_known_has_none_left() -> None:
    assert found(bench_arm(), recorded(bench_arm())).coulomb_nm == pytest.approx(np.zeros(7), abs=0.05)


def test_a_share_of_the_known_friction_is_found_with_its_viscous_and_stribeck_parts() -> None:
    robot = dataclasses.replace(
        bench_arm(), coulomb_nm=(1.0,) * 7, viscous_nm_s=(1.0,) * 7, stribeck_nm=(0.6,) * 7, stribeck_rad_s=(0.1,) * 7
    )
    friction = found(robot, recorded(robot, 24.0, joint_friction_fraction=0.5))
    for speed in (0.03, 0.1, 0.2, 0.5):
        torque = 0.5 * (1.0 + 0.6 * np.exp(-((speed / 0.1) ** 2)) + speed)
        assert parametric_torque(friction, np.full(7, speed)) == pytest.approx(np.full(7, torque), abs=0.09)  # a tenth


def test_a_robot_without_a_sensor_at_the_wrist_counts_the_tool_as_its_own() -> None:
    light = dataclasses.replace(
        GAME,
        ball=dataclasses.replace(GAME.ball, mass_kg=0.001),
        rope=dataclasses.replace(GAME.rope, stiffness_n_m=40.0, damping_n_s_m=0.04),
    )
    recording = recorded(bench_arm(), game=light, joint_friction_nm=0.5)
    blind = dataclasses.replace(recording, wrist_wrench=np.zeros_like(recording.wrist_wrench))
    assert found(bench_arm(), blind, light).coulomb_nm == pytest.approx(np.full(7, 0.5), abs=0.06)


def test_efforts_that_come_late_by_a_few_milliseconds_do_no_harm(worn: JointRecording) -> None:
    def late(values: Array) -> Array:
        return np.vstack([values[:1], values[:-1]])  # by one period of 4 ms

    shifted = dataclasses.replace(worn, effort_nm=late(worn.effort_nm), wrist_wrench=late(worn.wrist_wrench))
    assert found(bench_arm(), shifted).coulomb_nm == pytest.approx(np.full(7, 0.5), abs=0.06)


def test_a_robot_that_tells_no_efforts_is_refused(worn: JointRecording) -> None:
    mute = dataclasses.replace(worn, effort_nm=np.zeros_like(worn.effort_nm))
    with pytest.raises(
        HardwareError, match=r"reports no effort: every reading is 0 Nm.*leave the stage 'identify' out"
    ):
        Samples(bench_arm(), GAME).of(mute, SHIPPED.smoothing_s)


def test_a_joint_that_hardly_moves_is_named(worn: JointRecording) -> None:
    angles = worn.position_rad.copy()
    angles[:, 4] = angles[0, 4]
    with pytest.raises(StageError, match=r"joint 'e2' moved too little .*: 0 samples .* raise identify.duration_s"):
        Samples(bench_arm(), GAME).of(dataclasses.replace(worn, position_rad=angles), SHIPPED.smoothing_s)


def test_a_motion_shorter_than_two_windows_is_refused(worn: JointRecording) -> None:
    with pytest.raises(StageError, match=r"has 3001 samples; needed: more than 3002, two windows of 6.0 s: lower"):
        Samples(bench_arm(), GAME).of(worn, 6.0)


def model(names: tuple[str, ...]) -> FrictionModel:
    n = len(names)
    zeros, ones = np.zeros(n), np.ones(n)
    law = ParametricFriction(0.5 * ones, zeros, ones, 0.1 * ones, zeros)
    return FrictionModel(
        names, "parametric", law, NetworkFriction(np.zeros((n, 1, 3)), np.zeros((n, 2))), ones, ones, ones
    )


class Distant(ObedientRobot):
    missed = 3


def test_the_commanded_velocity_decides_the_torque_that_is_added() -> None:
    body = Distant()
    robot = CompensatedRobot(body, model(body.joint_names))
    moving = dataclasses.replace(command(0.1), velocity_rad_s=np.array([1.0, -2.0]), effort_nm=np.array([1.0, 0.0]))
    robot.exchange(moving)
    robot.exchange(command(0.1))
    assert body.carried_out[0].effort_nm == pytest.approx([1.6, -0.7])
    assert body.carried_out[1].effort_nm == pytest.approx([0.0, 0.0])  # at rest nothing is pushed
    robot.reset(np.zeros(2), 5)
    robot.close()
    assert (robot.missed, len(body.resets), body.halts) == (3, 1, 1)


def test_another_arm_than_the_configured_one_is_refused_before_anything_moves() -> None:
    body = ObedientRobot()
    three = np.zeros((3, 3))
    motion = JointTrajectory(("a", "b", "c"), np.arange(3.0), three, three, three)
    with pytest.raises(StageError, match=r"has the joints shoulder, elbow, the configured arm a, b, c: choose"):
        play(body, motion, 0)
    assert body.resets == []


def test_without_a_model_the_robot_is_as_it_was() -> None:
    body = Distant()
    assert compensated(body, None) is body


def test_a_model_for_other_joints_is_refused_before_anything_moves() -> None:
    with pytest.raises(StageError, match=r"for the joints a, b; this robot has shoulder, elbow: identify it again"):
        CompensatedRobot(Distant(), model(("a", "b")))
