"""A swing is fitted to the rope that hangs from the cup, and one that cannot be stays as it is."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory
from kendama_cli.control.imitation import FittedMotion, fitted, measured_rope_m, scaled_motion
from kendama_cli.control.reachable import Surroundings
from kendama_cli.devices.robot.simulated import SimulatedRobot
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.find_placement import current_placement
from tests.motion.swings import settings as encode_settings
from tests.stages.transfer_setup import ADAPT, GAME, ROBOT, SAFETY, TWIN

ARM = RobotModel(ROBOT, GAME.cup, GAME.gravity_m_s2)


def robot(rope_scale: float) -> SimulatedRobot:
    body = dataclasses.replace(TWIN.imperfection, rope_scale=rope_scale, rope_scale_spread=0.0)
    return SimulatedRobot(ROBOT, GAME, imperfection=body, control_period_s=0.004)


def swing(size_m: float, *, moving: bool = False) -> CatchMotion:
    """A primitive that brings the cup out and back within 2 s; ``moving``: cut, so that it needs a lead-in."""
    t_s = np.arange(501) * 0.004
    path = np.column_stack([size_m * np.sin(np.pi * t_s / 2.0) ** 2, np.zeros_like(t_s), np.zeros_like(t_s)])
    cut = 40 if moving else 0
    demonstration = Demonstration("swing", t_s[cut:] - t_s[cut], path[cut:] - path[cut])
    plan = encode_demonstrations([demonstration], encode_settings())
    joints = ArmMotion(ARM, plan, ADAPT.lead_in_m_s2).joints(plan.tau_scale, ADAPT.hold_s)
    return CatchMotion(plan, joints, current_placement(ARM), caught=False, success_rate=0.0)


def fit_to(rope_scale: float, motion: CatchMotion) -> FittedMotion:
    return fitted(robot(rope_scale), motion, Surroundings(ARM, GAME, ADAPT, SAFETY), seed=1)


def cup_m(joints: JointTrajectory, t_s: np.ndarray) -> np.ndarray:
    """The tie point relative to home (n, 3)."""
    columns = [np.interp(t_s, joints.t_s, column) for column in joints.position_rad.T]
    home_m = ARM.tool_position_m(ARM.home_rad)
    return np.array([ARM.tool_position_m(posture) - home_m for posture in np.column_stack(columns)])


@pytest.mark.parametrize("rope_scale", [0.9, 1.0, 1.07])
def test_the_rope_is_measured_to_a_millimetre_through_the_markers_noise(rope_scale: float) -> None:
    # 100 readings at 0.5 mm per axis, cup and ball: 0.07 mm of the mean; the ball's start offset swings it 3 mm aside
    measured = measured_rope_m(robot(rope_scale), ARM.home_rad, GAME, seed=5)
    assert measured == pytest.approx(rope_scale * GAME.rope.length_m, abs=1e-3)


@pytest.mark.parametrize("moving", [False, True], ids=["from rest", "with a lead-in"])
def test_the_fitted_swing_is_the_planned_one_larger_and_slower_as_a_longer_pendulum_is(moving: bool) -> None:
    planned = swing(0.2, moving=moving)
    fit = fit_to(1.05, planned)
    assert fit.resized
    assert fit.rope_scale == pytest.approx(1.05, abs=0.003)
    t_s = np.linspace(0.0, planned.joints.t_s[-1], 60)
    larger_m = fit.rope_scale * cup_m(planned.joints, t_s)
    # the inverse kinematics leaves 1e-6 m or so; an interpolation between samples 1 ms apart adds 5e-7 m
    assert cup_m(fit.joints, t_s * math.sqrt(fit.rope_scale)) == pytest.approx(larger_m, abs=5e-6)


def test_on_the_models_rope_the_motion_is_as_planned() -> None:
    planned = swing(0.2)
    joints = scaled_motion(ARM, planned.plan, 1.0, lead_in_m_s2=ADAPT.lead_in_m_s2, hold_s=ADAPT.hold_s)
    assert np.array_equal(joints.position_rad, planned.joints.position_rad)
    assert np.array_equal(joints.acceleration_rad_s2, planned.joints.acceleration_rad_s2)


def test_a_swing_that_the_arm_cannot_follow_when_resized_stays_as_planned_and_says_so() -> None:
    planned = swing(0.36)
    fit = fit_to(3.0, planned)
    assert not fit.resized
    assert fit.rope_scale == pytest.approx(3.0, abs=0.01)
    assert fit.joints is planned.joints
