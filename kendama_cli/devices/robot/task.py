"""Task that a robot is opened for: a game with cup, rope and ball, or an interaction of its probe with a scene."""

from __future__ import annotations

from kendama_cli.robot_model.model import RobotModel
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.interact import InteractionTask
from kendama_cli.settings.robot import RobotSettings

Task = GameSettings | InteractionTask
"""A simulated robot builds its world from it; a real one stands in that world already."""


def arm_of(robot: RobotSettings, task: Task) -> RobotModel:
    """Return the model of the arm with what it holds in this task: probe or cup."""
    if isinstance(task, InteractionTask):
        return RobotModel(robot, task.interact.probe, task.interact.gravity_m_s2)
    return RobotModel(robot, task.cup, task.gravity_m_s2)
