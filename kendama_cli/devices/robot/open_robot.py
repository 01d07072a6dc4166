"""Opening and closing of the robot that the configuration names, whatever happens in between."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from kendama_cli.devices.robot.interface import Robot
from kendama_cli.errors import ConfigError
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import ROBOTS, HardwareSettings
from kendama_cli.settings.robot import RobotSettings


@contextmanager
def open_robot(hardware: HardwareSettings, robot: RobotSettings, game: GameSettings) -> Iterator[Robot]:
    """Open the robot of the kind that ``hardware`` chooses, closed in the end.

    A robot that may be real has been armed before a stage begins (``kendama run --arm``, by the settings' ``moves``).
    Raises ConfigError where the settings do not declare it, and what opening raises.
    """
    if not isinstance(getattr(type(hardware), "moves", None), bool):
        raise ConfigError(
            "hardware.kind",
            f"the settings of robot '{hardware.kind}' do not say whether it moves a real arm; "
            f"declare 'moves: ClassVar[bool]' in {type(hardware).__name__}: True needs --arm",
        )
    with ROBOTS.maker(hardware.kind)(hardware, robot, game) as opened:
        yield opened
