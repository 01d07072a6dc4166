"""The shipped controllers, arms, scenes and scripts as settings, for tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from kendama_cli.plugins.interact.scene_settings import SceneSettings
from kendama_cli.plugins.interact.settings import ControllerSettings, InteractSettings
from kendama_cli.schema.settings import build, build_value
from kendama_cli.settings.robot import RobotSettings

CONF = Path(__file__).resolve().parents[3] / "conf"


def controller(kind: str, **changed: Any) -> ControllerSettings:
    """The shipped controller of this kind, some of its values changed."""
    values = yaml.safe_load((CONF / f"interact/controller/{kind}.yaml").read_text())
    made: ControllerSettings = build_value(ControllerSettings, values | changed, "interact.controller")
    return made


def press(kind: str = "force", **changed: Any) -> InteractSettings:
    """The shipped script with the shipped controller of this kind, some of its values changed."""
    values = yaml.safe_load((CONF / "interact/press.yaml").read_text())
    del values["defaults"]
    values["controller"] = yaml.safe_load((CONF / f"interact/controller/{kind}.yaml").read_text())
    return build(InteractSettings, values | changed, "interact")


def robot(name: str) -> RobotSettings:
    """A shipped arm whose description comes with the package."""
    values = yaml.safe_load((CONF / f"robot/{name}.yaml").read_text())
    return build(RobotSettings, values | {"path": str(CONF.parent / values["path"])}, "robot")


def body(name: str = "table", **changed: Any) -> dict[str, Any]:
    """The body of a shipped scene as plain values, some of them changed."""
    values: dict[str, Any] = yaml.safe_load((CONF / f"scene/{name}.yaml").read_text())["bodies"][0]
    return values | changed


def scene(*bodies: dict[str, Any]) -> SceneSettings:
    """A scene of these bodies."""
    return build(SceneSettings, {"bodies": list(bodies)}, "scene")
