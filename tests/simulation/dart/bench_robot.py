"""The shipped arm and game as settings, for tests."""

from __future__ import annotations

import copy
import dataclasses
import functools
from pathlib import Path
from typing import Any

import yaml
from omegaconf import OmegaConf

from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings
from tests.shipped_conf import plain

ROOT = Path(__file__).resolve().parents[3]


@functools.cache
def bench_arm() -> RobotSettings:
    """Return the arm that most tests use, whichever of the shipped ones it is: today the PA10."""
    values = yaml.safe_load((ROOT / "conf/robot/pa10.yaml").read_text())
    return build(RobotSettings, values | {"path": str(ROOT / values["path"])}, "robot")


def frictionless_bench_arm() -> RobotSettings:
    """The shipped PA10 without any joint friction."""
    none = (0.0,) * 7
    return dataclasses.replace(bench_arm(), coulomb_nm=none, viscous_nm_s=none, stribeck_nm=none)


@functools.cache
def kendama_game() -> GameSettings:
    """The shipped game."""
    return build(GameSettings, plain("game", "kendama"), "game")


def modelled(robot: RobotSettings) -> RobotModel:
    """What is believed about ``robot`` with the cup of the shipped game."""
    game = kendama_game()
    return RobotModel(robot, game.cup, game.gravity_m_s2)


def adapt_values() -> dict[str, Any]:
    """conf/adapt/catch.yaml with what it takes from the shipped transfer and predict settings."""
    return copy.deepcopy(_adapt_values())


@functools.cache
def _adapt_values() -> dict[str, Any]:
    nodes = {"adapt": ("adapt", "catch"), "transfer": ("transfer", "default"), "predict": ("predict", "flights")}
    composed = OmegaConf.create({name: plain(*choice) for name, choice in nodes.items()})
    resolved = OmegaConf.to_container(composed.adapt, resolve=True)
    assert isinstance(resolved, dict)
    return {str(name): value for name, value in resolved.items()}
