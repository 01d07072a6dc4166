"""A swing is fitted to the rope that hangs from the cup, and a swing that cannot be is told."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.devices.robot.simulated import SimulatedRobot
from kendama_cli.game.rope_fit import fitted, measured_rope_m
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.simulation.placement.placement import joint_trajectory
from tests.stages.test_transfer import GAME, ROBOT, TWIN

ARM = RobotModel(ROBOT, GAME.cup, GAME.gravity_m_s2)


def robot(rope_scale: float) -> SimulatedRobot:
    body = dataclasses.replace(TWIN.imperfection, rope_scale=rope_scale, rope_scale_spread=0.0)
    return SimulatedRobot(ROBOT, GAME, imperfection=body, control_period_s=0.004)


def swing(size_m: float, duration_s: float = 2.0) -> JointTrajectory:
    t_s = np.arange(round(duration_s / 0.004) + 1) * 0.004
    path = np.column_stack([size_m * np.sin(np.pi * t_s / duration_s) ** 2, np.zeros_like(t_s), np.zeros_like(t_s)])
    return joint_trajectory(ARM, t_s, path)


@pytest.mark.parametrize("rope_scale", [0.9, 1.0, 1.07])
def test_the_rope_is_measured_to_a_millimetre_through_the_markers_noise(rope_scale: float) -> None:
    # 100 looks at 0.5 mm per axis, cup and ball: 0.07 mm of the mean; the ball's start offset swings it 3 mm aside
    measured = measured_rope_m(robot(rope_scale), ARM.home_rad, GAME, seed=5)
    assert measured == pytest.approx(rope_scale * GAME.rope.length_m, abs=1e-3)


def test_the_fitted_swing_is_larger_and_slower_as_a_longer_pendulum_is() -> None:
    planned = swing(0.2)
    fit = fitted(robot(1.05), ARM, planned, GAME, seed=1)
    assert fit.resized
    assert fit.rope_scale == pytest.approx(1.05, abs=0.003)
    assert fit.joints.t_s[-1] == pytest.approx(planned.t_s[-1] * math.sqrt(fit.rope_scale))
    reach = [np.ptp([ARM.tool_place_m(row)[0] for row in joints.position_rad]) for joints in (planned, fit.joints)]
    assert reach[1] / reach[0] == pytest.approx(fit.rope_scale, abs=1e-3)


def test_a_swing_that_the_arm_cannot_follow_when_resized_stays_as_planned_and_says_so() -> None:
    planned = swing(0.36)
    fit = fitted(robot(3.0), ARM, planned, GAME, seed=1)
    assert not fit.resized
    assert fit.rope_scale == pytest.approx(3.0, abs=0.01)
    assert fit.joints is planned
