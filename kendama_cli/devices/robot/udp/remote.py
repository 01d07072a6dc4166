"""A robot at the other end of a UDP line."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager

import numpy as np

from kendama_cli.devices.robot.interface import Exchange, JointCommand
from kendama_cli.devices.robot.limiter import limit_command
from kendama_cli.devices.robot.udp import protocol
from kendama_cli.devices.robot.udp.commander_line import CommanderLine
from kendama_cli.devices.robot.udp.protocol import DatagramError, Kind
from kendama_cli.devices.robot.udp.seal import read_key
from kendama_cli.errors import HardwareError
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import CommandHardware
from kendama_cli.settings.robot import RobotSettings

_PERIODS_TO_WAIT = 3
"""In real time, an answer that is later than this many periods counts as lost, and the next command goes out."""


@contextmanager
def open_command(hardware: CommandHardware, robot: RobotSettings, game: GameSettings) -> Iterator[UdpRobot]:
    """Connect to the robot that listens there; raises InputError of the key, HardwareError if none answers."""
    secret = read_key(hardware.key_file)
    with closing(LimitedRobot(hardware.host, hardware.port, secret, silence_s=hardware.silence_s)) as client:
        yield client


class UdpRobot:
    """The Robot behind ``host:port``; opening it begins a session.

    The first fault raises HardwareError, halts the robot, and stays: every later call raises the same error.
    ``missed`` counts the periods in which the robot had no command in time, ``ignored`` the datagrams of others that
    came to either end. See CommanderLine for ``silence_s`` and ``exit_reason``.
    """

    def __init__(
        self,
        host: str,
        port: int,
        secret: bytes,
        *,
        silence_s: float,
        exit_reason: Callable[[], str | None] | None = None,
    ) -> None:
        self.missed = self._ignored_there = 0
        self._line = CommanderLine(host, port, secret, silence_s=silence_s, exit_reason=exit_reason)
        self._silence_s = silence_s
        try:
            welcome = protocol.unpack_welcome(self._line.greet())
        except DatagramError as error:
            failure = self._line.fail(str(error))
            self._line.close()
            raise failure from None
        self.joint_names = welcome.joint_names
        self.limits = welcome.limits
        self.period_s = welcome.period_s
        self.realtime = welcome.realtime
        self.watchdog_s = welcome.watchdog_s
        self._line.lockstep = not welcome.realtime

    @property
    def ignored(self) -> int:
        """Number of others' datagrams that came to either end so far, and were ignored."""
        return self._line.ignored + self._ignored_there

    def exchange(self, command: JointCommand) -> Exchange:
        """Carry out one control period; raises HardwareError when the line or the robot has failed."""
        packed = protocol.pack_command(command)
        if not self.realtime:
            return self._report(self._line.ask(Kind.COMMAND, packed, Kind.STATE))
        at_most_s, hold_s = min(self._silence_s, self.watchdog_s), _PERIODS_TO_WAIT * self.period_s
        return self._report(self._line.ask(Kind.COMMAND, packed, Kind.STATE, hold_s=hold_s, at_most_s=at_most_s))

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Bring the robot to rest at ``position_rad`` (n,) with the ball hanging still."""
        return self._report(self._line.ask(Kind.RESET, protocol.pack_reset(position_rad, seed), Kind.STATE))

    def halt(self) -> None:
        """Stop the robot and stay stopped; idempotent, never raises."""
        self._line.halt()

    def close(self) -> None:
        """Halt and let go of the line."""
        self._line.close()

    def _report(self, answer: bytes) -> Exchange:
        try:
            report = protocol.unpack_report(answer, len(self.joint_names))
        except DatagramError as error:
            raise self._line.fail(str(error)) from None
        self.missed, self._ignored_there = report.missed, report.ignored
        return report.exchange


class LimitedRobot(UdpRobot):
    """A robot behind a controller of others: commands are limited to what it reports before they are sent."""

    def __init__(self, host: str, port: int, secret: bytes, *, silence_s: float) -> None:
        super().__init__(host, port, secret, silence_s=silence_s)
        still = np.zeros(len(self.joint_names))
        self._last = JointCommand(still, still, still)

    def exchange(self, command: JointCommand) -> Exchange:
        """Command the nearest within the limits, as UdpRobot.exchange; an absurd command halts the robot."""
        most = self.limits.effort_nm
        try:
            sent = limit_command(self._last, command, self.limits, self.period_s)
        except HardwareError as absurd:
            raise self._line.fail(str(absurd)) from None
        self._last = dataclasses.replace(sent, effort_nm=np.clip(command.effort_nm, -most, most))
        return super().exchange(self._last)

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Reset as UdpRobot.reset does; a position outside of the limits halts the robot."""
        lower, upper = self.limits.lower_rad, self.limits.upper_rad
        if np.shape(position_rad) != lower.shape or not (self.limits.to_stop_rad(position_rad) >= 0).all():
            raise self._line.fail(
                f"the arm is to go to {np.asarray(position_rad).tolist()} rad; it says that it reaches "
                f"{lower.tolist()} to {upper.tolist()}"
            )
        self._last = JointCommand(np.asarray(position_rad), np.zeros_like(lower), np.zeros_like(lower))
        return super().reset(position_rad, seed)
