"""Declarations of the package; nothing heavy is imported."""

from kendama_cli.extension import Variant

DEMONSTRATOR = Variant(
    "bench", settings="bench.settings:DemonstratorSettings", makes="bench.demonstrator:open_demonstrators"
)
CAMERA = Variant("bench", settings="bench.settings:CameraSettings", makes="bench.camera:open_cameras")
ROBOT = Variant("bench", settings="bench.settings:RobotSettings", makes="bench.robot:open_robot")
DETECTOR = Variant("bench", settings="bench.settings:DetectorSettings", makes="bench.detector:Detector")
LEARNER = Variant("bench", settings="bench.settings:LearnerSettings", makes="bench.learner:LEARNER")
