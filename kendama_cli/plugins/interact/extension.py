"""Public names for task-space controllers of other packages, under the promise of ``kendama_cli.extension``."""

from kendama_cli.plugins.interact.impedance_law import TaskReference, pose_error
from kendama_cli.plugins.interact.interface import TaskController

__all__ = ["TaskController", "TaskReference", "pose_error"]
