"""Inputs of the transfer stage for its tests."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import CatchMotion, MotionPlan
from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.find_placement import current_placement
from kendama_cli.robot_model.placement.placement import joint_trajectory
from kendama_cli.stages.learn.stage import Learn
from tests.memory_context import MemoryContext
from tests.stages.transfer_setup import GAME, LEARN, ROBOT


@pytest.fixture(scope="session")
def policy() -> PolicyArtifact:
    quick = dataclasses.replace(LEARN, count=dataclasses.replace(LEARN.count, evaluation_rollouts=1))
    made: PolicyArtifact = Learn(learn=quick, game=GAME).run({}, MemoryContext(0)).artifact
    return made


@pytest.fixture(scope="session")
def still() -> CatchMotion:
    """A motion of half a second that only lifts the cup a little: it never catches."""
    t_s = np.arange(126) * 0.004
    lift = np.column_stack([np.zeros_like(t_s), np.zeros_like(t_s), 0.02 * np.sin(np.pi * t_s / 0.5) ** 2])
    joints = joint_trajectory(RobotModel(ROBOT, GAME.cup, GAME.gravity_m_s2), t_s, lift)
    one, two = np.zeros(1), np.ones(2)
    plan = MotionPlan(("z",), 0.5, 1.0, 100.0, 2.0, one, one, one, one, np.zeros((1, 2)), two, two, np.zeros((0, 6)))
    return CatchMotion(plan, joints, current_placement(RobotModel(ROBOT, GAME.cup, GAME.gravity_m_s2)), False, 0.0)
