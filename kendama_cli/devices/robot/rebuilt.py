"""The simulated robot, built anew for every rollout: in this process, or behind UDP as a twin."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager

from kendama_cli.devices.robot.interface import Exchange, JointCommand
from kendama_cli.devices.robot.simulated import SimulatedRobot
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import SimulatedHardware, TwinHardware
from kendama_cli.settings.robot import RobotSettings


class RebuiltRobot:
    """A simulated robot that is built anew at every reset.

    DART's constraint solver starts from what it found before, so that a world which is only put back to its start
    remembers earlier rollouts in the last bits; a rollout must not depend on which ones came before it.
    """

    def __init__(self, build: Callable[[], SimulatedRobot]) -> None:
        self._build = build
        self._robot = build()
        self.joint_names = self._robot.joint_names
        self.limits = self._robot.limits
        self.period_s = self._robot.period_s
        self.realtime = False
        self.missed = 0
        self._halted = False

    def exchange(self, command: JointCommand) -> Exchange:
        """Play one control period; raises HardwareError after ``halt``, SimulationError for what is not finite."""
        return self._robot.exchange(command)

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Rest in ``position_rad`` (n,); raises HardwareError after ``halt``."""
        if not self._halted:
            self._robot.close()
            self._robot = self._build()
        return self._robot.reset(position_rad, seed)

    def halt(self) -> None:
        """Stop and stay stopped."""
        self._halted = True
        self._robot.halt()

    def close(self) -> None:
        """Halt; there is no device to let go of."""
        self.halt()


def rebuilt_robot(hardware: SimulatedHardware | TwinHardware, robot: RobotSettings, game: GameSettings) -> RebuiltRobot:
    """Make the simulated robot that the settings describe."""
    return RebuiltRobot(
        lambda: SimulatedRobot(
            robot, game, imperfection=hardware.imperfection, control_period_s=hardware.control_period_s
        )
    )


@contextmanager
def open_simulated(hardware: SimulatedHardware, robot: RobotSettings, game: GameSettings) -> Iterator[RebuiltRobot]:
    """Open the simulated robot in this process."""
    with closing(rebuilt_robot(hardware, robot, game)) as made:
        yield made
