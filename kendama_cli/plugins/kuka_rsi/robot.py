"""An arm on a KUKA controller that runs RSI, behind the robot's interface."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import closing, contextmanager

import numpy as np

from kendama_cli.devices.robot.interface import Exchange, JointCommand, RobotState
from kendama_cli.devices.robot.limiter import approach, check_command
from kendama_cli.errors import ConfigError, HardwareError
from kendama_cli.plugins.kuka_rsi.link import RsiLink, in_degrees
from kendama_cli.plugins.kuka_rsi.settings import RsiHardware
from kendama_cli.plugins.kuka_rsi.telegram import AXES, Telegram, ahead_ms
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings

_SETTLED_DEG = 0.2
_SETTLE_S = 2.0


@contextmanager
def open_rsi(hardware: RsiHardware, robot: RobotSettings, game: GameSettings) -> Iterator[RsiRobot]:
    """Open the arm at its first telegram; raises ConfigError, MissingPartError if none comes, HardwareError."""
    with closing(RsiRobot(hardware, RobotModel(robot, game.cup, game.gravity_m_s2))) as made:
        yield made


class RsiRobot:
    """The Robot whose axes A1 to A6 RSI corrects; its limits are those of ``arm``, and the controller has its own.

    It adds no effort, and feels none at the wrist; the cup is where the measured joints have it, and the ball is not
    tracked. A period without a command in time brakes within the limits and is counted in ``missed``; ``late`` counts
    the answers that the controller found late.
    """

    realtime = True

    def __init__(self, hardware: RsiHardware, arm: RobotModel) -> None:
        n = len(arm.joint_names)
        if n != len(AXES):
            raise ConfigError(
                "hardware.kind",
                f"'hardware.kind' is 'rsi', which moves 6 axes; {arm.settings.name} has {n}: choose the arm's own "
                "description (robot=urdf robot.path=my_kuka.urdf)",
            )
        self._to_deg = math.degrees(1) * np.array(hardware.signs or (1,) * n, dtype=float)
        self._offset_deg = np.array(hardware.offset_deg or (0.0,) * n)
        self._arm, self._hardware = arm, hardware
        self.joint_names, self.limits, self.period_s = arm.joint_names, arm.limits, hardware.control_period_s
        self.missed = 0
        self._began: int | None = None
        self._exchanges = 0
        self._link = RsiLink(hardware, in_degrees(arm.limits, self._to_deg, self._offset_deg))
        try:
            self._link.start()
        except BaseException:
            self._link.close()
            raise
        self._read = self._link.newest

    @property
    def late(self) -> int:
        """Return the number of answers that the controller found late."""
        return self._link.late

    def exchange(self, command: JointCommand) -> Exchange:
        """Play one cycle of the controller; raises HardwareError when it or the line has failed, or after ``halt``."""
        try:
            check_command(command, self.limits)
        except HardwareError as error:
            raise self._link.fail(str(error)) from None
        sent, answered, after = self._move(command)
        self._began = answered.ipoc if self._began is None else self._began
        self._exchanges += 1
        t_s = 1e-3 * ahead_ms(after.ipoc, self._began)
        cycles = round(t_s / self.period_s)
        self.missed += cycles - self._exchanges
        self._exchanges = cycles
        return Exchange(sent, self._state(after), t_s)

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Go slowly to rest at ``position_rad``, wait until the arm is there; raises HardwareError where it is not."""
        rest = JointCommand(np.asarray(position_rad, dtype=float), np.zeros(len(AXES)), np.zeros(len(AXES)))
        way = self._from_deg(self._link.newest.position_deg), rest.position_rad
        for command in approach(way, self._hardware.approach_rad_s, self.period_s, self.period_s):
            self._move(command)
        for _ in range(round(_SETTLE_S / self.period_s)):
            sent, _, after = self._move(rest)
            off_deg = np.abs(after.position_deg - self._controllers_deg(rest.position_rad))
            if off_deg.max() < _SETTLED_DEG and np.array_equal(sent.position_rad, rest.position_rad):
                self._began, self._exchanges = None, 0
                return Exchange(sent, self._state(after), 0.0)
        axis = int(off_deg.argmax())
        raise self._link.fail(
            f"axis A{axis + 1} is {off_deg[axis]:.2f} deg from where it was told to be, as where RSI was corrected "
            "before this began; halted: end RSI, run this again, and start it then"
        )

    def halt(self) -> None:
        """Brake within the limits and stay stopped."""
        self._link.fail("the arm was halted from here and stays so: open it anew")

    def close(self) -> None:
        """Halt, brake, and answer no more: the controller ends RSI."""
        self.halt()
        self._link.rest()
        self._link.close()

    def _move(self, command: JointCommand) -> tuple[JointCommand, Telegram, Telegram]:
        """Send ``command`` in the controller's angles; raises HardwareError, and halts, for one too far away."""
        wanted_deg = self._controllers_deg(command.position_rad)
        most, way = self._hardware.max_correction_deg, wanted_deg - self._link.start_deg
        if np.abs(way).max() > most:
            axis = int(np.abs(way).argmax())
            raise self._link.fail(
                f"axis A{axis + 1} would be {way[axis]:.1f} deg from where RSI began; allowed: {most:g} "
                "(hardware.max_correction_deg, and AXISCORR on the controller); halted"
            )
        scaled = (self._to_deg * one for one in (command.velocity_rad_s, command.acceleration_rad_s2))
        sent, answered, after = self._link.move(JointCommand(wanted_deg, *scaled))
        back = (one / self._to_deg for one in (sent.velocity_rad_s, sent.acceleration_rad_s2))
        exact = np.array_equal(sent.position_rad, wanted_deg)
        place = command.position_rad if exact else self._from_deg(sent.position_rad)
        return JointCommand(place, *back), answered, after

    def _state(self, telegram: Telegram) -> RobotState:
        position, before = (self._from_deg(one.position_deg) for one in (telegram, self._read))
        velocity = (position - before) / max(1e-3 * ahead_ms(telegram.ipoc, self._read.ipoc), self.period_s)
        self._read = telegram
        nothing = np.zeros(len(AXES))
        return RobotState(
            position, velocity, nothing, np.zeros(6), self._arm.tool_position_m(position), np.full(3, np.nan), False
        )

    def _controllers_deg(self, position_rad: Array) -> Array:
        return self._offset_deg + self._to_deg * position_rad

    def _from_deg(self, position_deg: Array) -> Array:
        return np.asarray((position_deg - self._offset_deg) / self._to_deg)
