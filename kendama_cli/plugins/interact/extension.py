"""Public names for task-space controllers of other packages, under the promise of ``kendama_cli.extension``."""

from kendama_cli.plugins.interact.impedance_law import pose_error
from kendama_cli.plugins.interact.interface import JointTorque, TaskController, TaskReference, TaskState

__all__ = ["JointTorque", "TaskController", "TaskReference", "TaskState", "pose_error"]
