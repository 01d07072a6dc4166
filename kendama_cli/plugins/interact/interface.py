"""Interface of every task-space controller."""

from __future__ import annotations

from typing import Protocol

from kendama_cli.plugins.interact.impedance_law import TaskReference
from kendama_cli.robot_model.joint_torque import JointTorque, TaskState
from kendama_cli.schema.arrays import Array


class TaskController(Protocol):
    """Controller from the tool's desired pose and force to torques; a call of ``command`` is one control period."""

    def reset(self, posture_rad: Array) -> None:
        """Forget what happened; ``posture_rad`` (n,) is kept to where the tool leaves the joints free."""

    def command(self, state: TaskState, reference: TaskReference, period_s: float) -> JointTorque:
        """Return the torques for the coming control period."""
