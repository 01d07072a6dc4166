"""Public names for parts of other packages: ``from kendama_cli.extension import Variant, setting, StageDeclaration``.

Declarations, settings, errors, interfaces, artifacts, messages and what draws chapters stand here under the promise of
``kendama_cli`` itself: a name stays what it is from one minor version to the next. From 1.0 on a name that goes is kept
for one minor version more, with a warning that tells the new one. Everything else of the package may move.

Each name is imported when it is first asked for, so that a declaration stays light. ``kendama_cli.conformance`` tries
a part by the laws of its interface.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from kendama_cli.schema.public_names import homes

if TYPE_CHECKING:
    from kendama_cli.artifacts.demonstration import Demonstration as Demonstration
    from kendama_cli.artifacts.motion_plan import CatchMotion as CatchMotion
    from kendama_cli.artifacts.motion_plan import JointTrajectory as JointTrajectory
    from kendama_cli.artifacts.motion_plan import MotionPlan as MotionPlan
    from kendama_cli.artifacts.policy import PolicyArtifact as PolicyArtifact
    from kendama_cli.devices.camera.interface import Camera as Camera
    from kendama_cli.devices.camera.interface import Frame as Frame
    from kendama_cli.devices.camera.interface import OpenCameras as OpenCameras
    from kendama_cli.devices.camera.interface import RegionOfInterest as RegionOfInterest
    from kendama_cli.devices.camera.interface import SceneSource as SceneSource
    from kendama_cli.devices.camera.interface import StaleFrame as StaleFrame
    from kendama_cli.devices.camera.interface import too_old as too_old
    from kendama_cli.devices.demonstrator.interface import Demonstrator as Demonstrator
    from kendama_cli.devices.demonstrator.interface import DemonstratorSample as DemonstratorSample
    from kendama_cli.devices.demonstrator.live_figures import LiveFigures as LiveFigures
    from kendama_cli.devices.robot.interface import Exchange as Exchange
    from kendama_cli.devices.robot.interface import JointCommand as JointCommand
    from kendama_cli.devices.robot.interface import Robot as Robot
    from kendama_cli.devices.robot.interface import RobotState as RobotState
    from kendama_cli.devices.robot.limiter import limit_command as limit_command
    from kendama_cli.errors import ConfigError as ConfigError
    from kendama_cli.errors import HardwareError as HardwareError
    from kendama_cli.errors import InputError as InputError
    from kendama_cli.errors import KendamaError as KendamaError
    from kendama_cli.errors import MissingPartError as MissingPartError
    from kendama_cli.errors import StageError as StageError
    from kendama_cli.errors import UsageError as UsageError
    from kendama_cli.learning.decision import HeldAction as HeldAction
    from kendama_cli.learning.decision import task_meaning as task_meaning
    from kendama_cli.learning.discretisation import StateGrid as StateGrid
    from kendama_cli.learning.interface import FinishedRollout as FinishedRollout
    from kendama_cli.learning.interface import Learner as Learner
    from kendama_cli.learning.interface import LearnerMaker as LearnerMaker
    from kendama_cli.learning.interface import Policy as Policy
    from kendama_cli.learning.reward import final_reward as final_reward
    from kendama_cli.learning.settings import LearnSettings as LearnSettings
    from kendama_cli.learning.state import SwingState as SwingState
    from kendama_cli.learning.statistics import LearningCount as LearningCount
    from kendama_cli.log.episode import Episode as Episode
    from kendama_cli.log.episode import Episodes as Episodes
    from kendama_cli.motion.dmp.primitive import DmpMotion as DmpMotion
    from kendama_cli.motion.dmp.primitive import play as play
    from kendama_cli.pipeline.log_export import ExportRequest as ExportRequest
    from kendama_cli.pipeline.where import Cluster as Cluster
    from kendama_cli.report.chapters import EnsembleChapter as EnsembleChapter
    from kendama_cli.report.figure import Figure as Figure
    from kendama_cli.report.figure import Panel as Panel
    from kendama_cli.report.figure import figure as figure
    from kendama_cli.report.plot import Drawing as Drawing
    from kendama_cli.report.plot import drawing as drawing
    from kendama_cli.report.plot import legend_above as legend_above
    from kendama_cli.report.replay.performance import Performance as Performance
    from kendama_cli.report.replay.performance import performance as performance
    from kendama_cli.report.source import StageLog as StageLog
    from kendama_cli.robot_model.arm_scene import ArmScene as ArmScene
    from kendama_cli.robot_model.limits import JointLimits as JointLimits
    from kendama_cli.schema.declaration import Headline as Headline
    from kendama_cli.schema.declaration import StageDeclaration as StageDeclaration
    from kendama_cli.schema.foxglove import CompressedImage as CompressedImage
    from kendama_cli.schema.foxglove import FrameTransform as FrameTransform
    from kendama_cli.schema.foxglove import FrameTransforms as FrameTransforms
    from kendama_cli.schema.foxglove import JointStates as JointStates
    from kendama_cli.schema.foxglove import SceneUpdate as SceneUpdate
    from kendama_cli.schema.foxglove import Solid as Solid
    from kendama_cli.schema.registry import Registry as Registry
    from kendama_cli.schema.registry import Variant as Variant
    from kendama_cli.schema.settings import setting as setting
    from kendama_cli.settings.camera import CameraModelSettings as CameraModelSettings
    from kendama_cli.settings.camera import CameraRig as CameraRig
    from kendama_cli.settings.camera import FrameTiming as FrameTiming
    from kendama_cli.settings.game import GameSettings as GameSettings
    from kendama_cli.settings.robot import RobotSettings as RobotSettings
    from kendama_cli.settings.store import StoreSettings as StoreSettings
    from kendama_cli.stages.interface import LogWriter as LogWriter
    from kendama_cli.stages.interface import Stage as Stage
    from kendama_cli.stages.interface import StageContext as StageContext
    from kendama_cli.stages.interface import StageResult as StageResult
    from kendama_cli.store.store import Shared as Shared
    from kendama_cli.store.store import SharedDamage as SharedDamage
    from kendama_cli.store.store import Store as Store
    from kendama_cli.store.store import StoredResult as StoredResult
    from kendama_cli.vision.cameras.camera_model import CameraModel as CameraModel
    from kendama_cli.vision.detection.interface import Detector as Detector
    from kendama_cli.vision.detection.interface import SearchHint as SearchHint
    from kendama_cli.vision.detection.interface import Sighting as Sighting

__all__ = list(homes())


def __getattr__(name: str) -> Any:
    """Return the public object ``name``, imported from the module that defines it."""
    if name not in homes():
        raise AttributeError(f"module 'kendama_cli.extension' has no attribute '{name}'")
    found = getattr(importlib.import_module(homes()[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted(homes())
