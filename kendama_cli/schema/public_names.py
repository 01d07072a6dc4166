"""Public names for parts of other packages, by the module that defines them: ``kendama_cli.extension`` offers them.

A table of texts, so that nothing is imported for it and the digest of a stranger's code finds what a name brings.
"""

from __future__ import annotations

EXTENSION = "kendama_cli.extension"
DEFINED: dict[str, tuple[str, ...]] = {
    # declarations
    "kendama_cli.schema.declaration": ("Headline", "StageDeclaration"),
    "kendama_cli.schema.registry": ("Registry", "Variant"),
    # settings
    "kendama_cli.schema.settings": ("setting",),
    "kendama_cli.settings.camera": ("CameraModelSettings", "CameraRig", "FrameTiming"),
    "kendama_cli.settings.game": ("GameSettings",),
    "kendama_cli.settings.robot": ("RobotSettings",),
    "kendama_cli.learning.settings": ("LearnSettings",),
    # errors
    "kendama_cli.errors": (
        "ConfigError",
        "HardwareError",
        "InputError",
        "KendamaError",
        "MissingPartError",
        "StageError",
        "UsageError",
    ),
    # interfaces: stages and devices
    "kendama_cli.stages.interface": ("LogWriter", "Stage", "StageContext", "StageResult"),
    "kendama_cli.devices.demonstrator.interface": ("Demonstrator", "DemonstratorSample"),
    "kendama_cli.devices.streams.live_figures": ("LiveFigures",),
    "kendama_cli.devices.camera.interface": (
        "Camera",
        "Frame",
        "OpenCameras",
        "RegionOfInterest",
        "SceneSource",
        "StaleFrame",
        "too_old",
    ),
    "kendama_cli.vision.cameras.camera_model": ("CameraModel",),
    "kendama_cli.devices.robot.interface": (
        "Exchange",
        "JointCommand",
        "Robot",
        "RobotState",
        "TorqueExchange",
        "TorqueInterface",
    ),
    "kendama_cli.devices.robot.limiter": ("limit_command",),
    "kendama_cli.robot_model.joint_torque": ("JointTorque", "TaskState"),
    "kendama_cli.robot_model.limits": ("JointLimits",),
    # interfaces: machines, stores and exports
    "kendama_cli.pipeline.where": ("Cluster",),
    "kendama_cli.store.store": ("Shared", "SharedDamage", "Store", "StoredResult"),
    "kendama_cli.settings.store": ("StoreSettings",),
    "kendama_cli.pipeline.log_export": ("ExportRequest",),
    # interfaces: seeing and learning
    "kendama_cli.vision.detection.interface": ("Detector", "SearchHint", "Sighting"),
    "kendama_cli.learning.interface": ("FinishedRollout", "Learner", "LearnerMaker", "Policy"),
    "kendama_cli.learning.discretisation": ("StateGrid",),
    "kendama_cli.learning.decision": ("HeldAction", "task_meaning"),
    "kendama_cli.learning.reward": ("final_reward",),
    "kendama_cli.learning.state": ("SwingState",),
    "kendama_cli.learning.statistics": ("LearningCount",),
    # artifacts, and what plays them
    "kendama_cli.artifacts.demonstration": ("Demonstration",),
    "kendama_cli.artifacts.motion_plan": ("CatchMotion", "JointTrajectory", "MotionPlan"),
    "kendama_cli.artifacts.policy": ("PolicyArtifact",),
    "kendama_cli.motion.dmp.primitive": ("DmpMotion", "play"),
    # messages of logs
    "kendama_cli.schema.foxglove": (
        "CompressedImage",
        "FrameTransform",
        "FrameTransforms",
        "JointStates",
        "SceneUpdate",
        "Solid",
    ),
    "kendama_cli.robot_model.arm_scene": ("ArmScene",),
    # what others learn from
    "kendama_cli.log.episode": ("Episode", "Episodes"),
    # chapters of reports
    "kendama_cli.report.chapters": ("EnsembleChapter",),
    "kendama_cli.report.source": ("StageLog",),
    "kendama_cli.report.figure": ("Figure", "Panel", "figure"),
    "kendama_cli.report.plot": ("Drawing", "drawing", "legend_above"),
    "kendama_cli.report.replay.performance": ("Performance", "performance"),
}
HOMES = {name: module for module, names in DEFINED.items() for name in names}


def at_home(modules: list[str]) -> list[str]:
    """Return what a file imports with each public name as the module that defines it.

    A file that imports the extension without naming anything of it may use any name, so it has them all. The extension
    itself is left out: it only offers.
    """
    offered = [one.removeprefix(f"{EXTENSION}.") for one in modules if one.startswith(f"{EXTENSION}.")]
    if EXTENSION in modules and (not offered or "*" in offered):
        offered = list(HOMES)
    others = [one for one in modules if one != EXTENSION and not one.startswith(f"{EXTENSION}.")]
    return others + [HOMES[name] for name in offered if name in HOMES]
