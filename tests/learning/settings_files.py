"""The shipped settings, with single values replaced."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.learn import LearnSettings
from kendama_cli.settings.schema import build

CONF = Path(__file__).parents[2] / "conf"


def learn_settings(name: str = "sarsa", **replaced: Any) -> LearnSettings:
    """``conf/learn/<name>.yaml`` with ``grid__angle_bins=9`` standing for learn.grid.angle_bins=9."""
    plain = yaml.safe_load((CONF / "learn" / f"{name}.yaml").read_text())
    for key, value in replaced.items():
        *groups, last = key.split("__")
        place = plain
        for group in groups:
            place = place[group]
        place[last] = value
    return build(LearnSettings, plain, "learn")


def game_settings() -> GameSettings:
    """``conf/game/kendama.yaml``."""
    return build(GameSettings, yaml.safe_load((CONF / "game" / "kendama.yaml").read_text()), "game")
