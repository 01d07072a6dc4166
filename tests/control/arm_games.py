"""Games on the simulated arm without UDP."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from kendama_cli.config.compose import composed
from kendama_cli.config.site import find_site
from kendama_cli.control.game_runner import GameBuilder, GameRunner, GameSetup
from kendama_cli.control.open_observer import CameraSetup
from kendama_cli.devices.robot.interface import Robot
from kendama_cli.devices.robot.rebuilt import RebuiltRobot
from kendama_cli.devices.robot.simulated import SimulatedRobot
from kendama_cli.pipeline.nodes import build_settings


@contextmanager
def arm_games(node: dict[str, Any], *, nominal: bool) -> Iterator[GameRunner]:
    """Open games on the simulated arm; ``nominal``: the body that the model describes."""
    game, transfer, hardware = node["game"], node["transfer"], node["hardware"]
    build = functools.partial(
        SimulatedRobot,
        node["robot"],
        game,
        imperfection=None if nominal else hardware.imperfection,
        control_period_s=hardware.control_period_s,
    )
    cameras = CameraSetup(node["camera"], node["lighting"], node["predict"])
    builder = GameBuilder(GameSetup(node["robot"], game, node["learn"], transfer, cameras))
    with builder.open(cast(Robot, RebuiltRobot(build)), seed=5) as runner:
        yield runner


def nodes(folder: Path, *overrides: str) -> dict[str, Any]:
    """Return the settings with ``overrides``; games are learned on the rail."""
    return build_settings(composed(find_site(folder), ["simulation/engine=rail", *overrides]))
