"""The transfer stage as it ships, cut short, for the tests of it."""

from __future__ import annotations

import dataclasses

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.control.settings import TransferSettings
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.camera import CameraSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings, TwinHardware
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.safety import SafetySettings
from kendama_cli.stages.transfer.stage import Transfer
from kendama_cli.vision.settings import PredictSettings
from tests.learning.settings_files import learn_settings
from tests.shipped_conf import configured, plain
from tests.simulation.dart.bench_robot import adapt_values

GAME: GameSettings = configured(GameSettings, "game", "kendama")
ROBOT: RobotSettings = configured(RobotSettings, "robot", "pa10")
TWIN: TwinHardware = configured(HardwareSettings, "hardware", "twin")
LEARN: LearnSettings = learn_settings()
CAMERA: CameraSettings = configured(CameraSettings, "camera", "virtual")
LIGHTING: LightingSettings = configured(LightingSettings, "lighting", "bright")
PREDICT: PredictSettings = configured(PredictSettings, "predict", "flights")
ADAPT: AdaptSettings = build_value(AdaptSettings, adapt_values(), "adapt")
SAFETY = build_value(SafetySettings, plain("safety", "default"), "safety")
FULL: TransferSettings = configured(TransferSettings, "transfer", "default")
SHORT = dataclasses.replace(FULL, evaluation_rollouts=1, max_rollouts=2, games=2, imitation_attempts=2, baseline=True)


def stage(
    settings: TransferSettings = SHORT,
    hardware: HardwareSettings = TWIN,
    adapt: AdaptSettings | None = ADAPT,
    safety: SafetySettings | None = SAFETY,
) -> Transfer:
    """The stage of the full game, as its pipeline would build it."""
    return Transfer(
        transfer=settings,
        hardware=hardware,
        robot=ROBOT,
        game=GAME,
        learn=LEARN,
        camera=CAMERA,
        lighting=LIGHTING,
        predict=PREDICT,
        adapt=adapt,
        safety=safety,
    )
