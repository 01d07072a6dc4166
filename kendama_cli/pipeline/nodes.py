"""The top-level nodes of the configuration and the settings that each becomes."""

from __future__ import annotations

import functools
import importlib.metadata
from collections.abc import Mapping
from typing import Any

from kendama_cli.devices.hand.settings import CaptureSettings
from kendama_cli.devices.robot.identify_settings import IdentifySettings
from kendama_cli.errors import ConfigError
from kendama_cli.game.settings import TransferSettings
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.motion.settings import EncodeSettings
from kendama_cli.motion.task_settings import InteractSettings
from kendama_cli.schema.settings import build_value, unknown_key
from kendama_cli.settings.camera import CameraSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.scene import SceneSettings
from kendama_cli.simulation.catch.settings import AdaptSettings
from kendama_cli.vision.settings import PredictSettings

NODES: Mapping[str, Any] = {
    "game": GameSettings,
    "capture": CaptureSettings,
    "encode": EncodeSettings,
    "robot": RobotSettings,
    "scene": SceneSettings,
    "interact": InteractSettings,
    "identify": IdentifySettings,
    "adapt": AdaptSettings,
    "learn": LearnSettings,
    "camera": CameraSettings,
    "lighting": LightingSettings,
    "predict": PredictSettings,
    "hardware": HardwareSettings,
    "transfer": TransferSettings,
}


@functools.cache
def node_schemas() -> Mapping[str, Any]:
    """Schema by node: our own, and those that projects registered under the entry point group ``kendama.settings``."""
    registered = {point.name: point.load() for point in importlib.metadata.entry_points(group="kendama.settings")}
    return {**registered, **NODES}


def build_settings(config: Mapping[str, Any]) -> dict[str, Any]:
    """Settings by node, and ``seed``, from the composed configuration; raises ConfigError naming the key."""
    schemas = NODES if set(config) <= {*NODES, "seed"} else node_schemas()
    for name in config:
        if name != "seed" and name not in schemas:
            raise unknown_key(str(name), [*schemas, "seed"])
    seed = config.get("seed")
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ConfigError("seed", f"'seed' is {seed!r}; allowed: a whole number, 0 or more")
    missing = [name for name in schemas if name in NODES and name not in config]
    if missing:
        raise ConfigError(missing[0], f"missing key '{missing[0]}': the configuration must choose one")
    return {"seed": seed} | {name: build_value(schemas[name], config[name], name) for name in config if name != "seed"}
