"""The body that transfer logs for another physics is the one that played."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

from kendama_cli.control.scene_history import SceneHistory, SceneRecordingRobot, joint_places
from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.devices.robot.simulated import SimulatedRobot
from kendama_cli.physics.rim_crossing import SampledBody
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.hardware import HardwareSettings, SimulatedHardware
from kendama_cli.settings.robot import Imperfection
from kendama_cli.stages.transfer.trace import imperfection, played_body
from tests.devices.robot.test_simulated import WORN
from tests.shipped_conf import plain
from tests.simulation.dart.bench_robot import bench_arm, kendama_game, modelled

GAME = kendama_game()
OTHER = dataclasses.replace(WORN, rope_scale_spread=0.0, mass_scale=1.3, drag_scale=3.0)
MEASURED_M = 0.41


def body(made: Imperfection, seed: int = 10000, *, told: bool = True) -> SampledBody:
    """What is logged of a robot of this imperfection, whose rope was measured as ``MEASURED_M``."""
    history = SceneHistory(functools.partial(joint_places, modelled(bench_arm())), MEASURED_M, np.zeros(3))
    simulated = SimulatedRobot(bench_arm(), GAME, imperfection=made, control_period_s=0.004)
    robot, home = SceneRecordingRobot(simulated, history), np.array(bench_arm().home_rad)
    robot.reset(home, seed)
    for _ in range(5):
        robot.exchange(JointCommand(home, np.zeros(7), np.zeros(7)))
    return played_body(GAME, made if told else None, history)


def test_the_body_of_a_simulated_robot_is_its_own() -> None:
    made = body(OTHER)
    assert made.rope_m == pytest.approx(OTHER.rope_scale * GAME.rope.length_m, abs=1e-9)
    assert made.ball_kg == pytest.approx(1.3 * GAME.ball.mass_kg)
    assert made.drag == pytest.approx([3.0 * one for one in GAME.drag])
    assert made.restitution == GAME.cup.restitution


def test_a_rope_that_is_drawn_anew_is_that_of_the_game_that_was_played() -> None:
    spread = dataclasses.replace(OTHER, rope_scale_spread=0.01)
    lengths = np.array([body(spread, seed).rope_m for seed in (10000, 10001, 10002)])
    assert np.abs(lengths / (OTHER.rope_scale * GAME.rope.length_m) - 1.0).max() <= 0.01
    assert np.ptp(lengths) > 1e-4


def test_of_a_robot_that_nobody_made_the_settings_and_the_measured_rope_are_logged() -> None:
    of_settings = SampledBody(MEASURED_M, GAME.ball.mass_kg, GAME.drag, GAME.cup.restitution, 0.0)
    assert body(OTHER, told=False) == of_settings


def test_only_the_settings_of_our_simulated_robots_tell_how_they_differ() -> None:
    values = plain("hardware", "twin")
    twin = build_value(HardwareSettings, values | {"imperfection": dataclasses.asdict(OTHER)}, "hardware")
    assert imperfection(twin) == OTHER
    assert imperfection(SimulatedHardware("simulated", 0.004, None)) is None
    command = plain("hardware", "command") | {"key_file": "key", "host": "127.0.0.1", "port": 5005}
    assert imperfection(build_value(HardwareSettings, command, "hardware")) is None
