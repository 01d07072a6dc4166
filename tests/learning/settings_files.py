"""The shipped settings, with single values replaced."""

from __future__ import annotations

import copy
import functools
from pathlib import Path
from typing import Any

import yaml
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from kendama_cli.learning.settings import LearnSettings
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from tests.shipped_conf import plain as shipped

CONF = Path(__file__).parents[2] / "conf"
NEEDED = ("game", "learn", "robot", "simulation/engine", "simulation/validation", "transfer")
"""The groups that the node learn may be made of; composed without all others in less than half the time."""


@functools.cache
def _composed(choices: tuple[str, ...]) -> dict[str, Any]:
    with initialize_config_dir(str(CONF), version_base="1.3"):
        chosen = ("simulation/engine=rail", *choices, *_left_out())
        plain: dict[str, Any] = OmegaConf.to_container(compose("config", overrides=list(chosen)).learn, resolve=True)
    return plain


@functools.cache
def _left_out() -> list[str]:
    entries = yaml.safe_load((CONF / "config.yaml").read_text())["defaults"]
    return [f"~{group}" for entry in entries if entry != "_self_" for group in entry if group not in NEEDED]


def learn_settings(name: str = "easy", *choices: str, **replaced: Any) -> LearnSettings:
    """``learn/task=<name>`` and further ``choices``; ``grid__angle_bins=9`` stands for learn.grid.angle_bins=9."""
    plain = copy.deepcopy(_composed((f"learn/task={name}", *choices)))
    for key, value in replaced.items():
        *groups, last = key.split("__")
        position = plain
        for group in groups:
            position = position[group]
        position[last] = value
    return build(LearnSettings, plain, "learn")


def game_settings() -> GameSettings:
    """``conf/game/kendama.yaml``."""
    return build(GameSettings, shipped("game", "kendama"), "game")
