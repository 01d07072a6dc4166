"""A robot at the other end of a UDP line: the commander's end."""

from __future__ import annotations

import secrets
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress

from kendama_cli.devices.robot import protocol
from kendama_cli.devices.robot.interface import Exchange, JointCommand, TorqueExchange
from kendama_cli.devices.robot.protocol import Datagram, DatagramError, Kind, Report
from kendama_cli.devices.robot.task import Task
from kendama_cli.devices.robot.torque_protocol import pack_torque, unpack_torque_report
from kendama_cli.errors import HardwareError
from kendama_cli.motion.impedance import JointTorque
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.hardware import UdpHardware
from kendama_cli.settings.robot import RobotSettings

_CHECK_S = 0.25
"""How often a waiting commander checks whether the other process still lives."""
_PERIODS_TO_WAIT = 3
"""In real time, an answer that is later than this many periods counts as lost, and the next command goes out."""


@contextmanager
def open_udp(hardware: UdpHardware, robot: RobotSettings, task: Task) -> Iterator[UdpRobot]:
    """Whatever robot listens at the configured address; raises HardwareError where none answers."""
    with closing(UdpRobot(hardware.host, hardware.port, silence_s=hardware.silence_s)) as client:
        yield client


class UdpTorque:
    """The TorqueInterface of a robot behind UDP."""

    def __init__(self, robot: UdpRobot, period_s: float) -> None:
        self.period_s = period_s
        self.effort_nm = robot.limits.effort_nm
        self._robot = robot

    def exchange(self, command: JointTorque) -> TorqueExchange:
        """See UdpRobot.exchange_torque."""
        return self._robot.exchange_torque(command)


class UdpRobot:
    """The Robot behind ``host:port``; opening it is the handshake.

    The first fault raises HardwareError, halts the robot, and stays: every later call raises
    the same error. ``exit_reason`` says how the other process ended, or None while it lives. ``missed`` counts the
    periods in which the robot had no command in time.
    """

    def __init__(
        self,
        host: str,
        port: int,
        *,
        silence_s: float,
        exit_reason: Callable[[], str | None] = lambda: None,
        session: int | None = None,
    ) -> None:
        self.missed = 0
        self._where = f"the robot at {host}:{port}"
        self._silence_s = silence_s
        self._exit_reason = exit_reason
        self._session = secrets.randbits(63) if session is None else session
        self._sequence = -1
        self._failure: str | None = None
        try:
            family, kind, proto, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._line = socket.socket(family, kind, proto)
            self._line.connect(address)  # the kernel then drops whatever a foreign sender sends us
        except OSError as error:
            raise HardwareError(f"{self._where} cannot be reached: {error}") from None
        try:
            welcome = protocol.unpack_welcome(self._ask(Kind.HELLO, b"", Kind.WELCOME))
        except HardwareError:
            self._line.close()
            raise
        self.joint_names = welcome.joint_names
        self.limits = welcome.limits
        self.period_s = welcome.period_s
        self.realtime = welcome.realtime
        self.watchdog_s = welcome.watchdog_s
        self.torque = UdpTorque(self, welcome.torque_period_s) if welcome.torque_period_s > 0 else None

    def exchange(self, command: JointCommand) -> Exchange:
        """Carry out one control period; raises HardwareError when the line or the robot has failed."""
        payload = protocol.pack_command(command)
        return self._report(Kind.COMMAND, payload).exchange

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Bring the robot to rest at ``position_rad`` (n,) with the ball hanging still."""
        return self._report(Kind.RESET, protocol.pack_reset(position_rad, seed)).exchange

    def exchange_torque(self, command: JointTorque) -> TorqueExchange:
        """Carry out one period of torque control; raises HardwareError when the line or the robot has failed."""
        answer = self._ask(Kind.TORQUE, pack_torque(command), Kind.TORQUE_STATE)
        try:
            report = unpack_torque_report(answer, len(self.joint_names))
        except DatagramError as error:
            raise self._fail(str(error)) from None
        self.missed = report.missed
        return report.exchange

    def halt(self) -> None:
        """Stop the robot and stay stopped; idempotent, never raises."""
        if self._failure is None:
            self._failure = f"{self._where} was halted from here"
            self._send_halt()

    def close(self) -> None:
        """Halt and let go of the line."""
        self.halt()
        self._line.close()

    def _report(self, kind: Kind, payload: bytes) -> Report:
        answer = self._ask(kind, payload, Kind.STATE)
        try:
            report = protocol.unpack_report(answer, len(self.joint_names))
        except DatagramError as error:
            raise self._fail(str(error)) from None
        self.missed = report.missed
        return report

    def _ask(self, kind: Kind, payload: bytes, wanted: Kind) -> bytes:
        if self._failure is not None:
            raise HardwareError(self._failure)
        hold = kind in (Kind.COMMAND, Kind.TORQUE) and self.realtime
        wait_s = _PERIODS_TO_WAIT * self._period_s(kind) if hold else self._silence_s
        give_up_s = time.monotonic() + (min(self._silence_s, self.watchdog_s) if hold else self._silence_s)
        while True:
            self._send(kind, payload)
            answer = self._await(wanted, min(time.monotonic() + wait_s, give_up_s), stale_is_late=hold)
            if answer is not None:
                return answer
            if time.monotonic() >= give_up_s:
                raise self._fail(f"no answer to {kind.name} {self._sequence} within {self._silence_s:g} s")

    def _period_s(self, kind: Kind) -> float:
        return self.torque.period_s if kind is Kind.TORQUE and self.torque is not None else self.period_s

    def _send(self, kind: Kind, payload: bytes) -> None:
        self._sequence += 1
        try:
            self._line.send(protocol.pack(Datagram(kind, self._session, self._sequence, payload)))
        except ConnectionRefusedError:
            raise self._fail(self._exit_reason() or "nothing listens there any more") from None
        except OSError as error:
            raise self._fail(f"the line cannot be written to: {error}") from None

    def _await(self, wanted: Kind, until_s: float, *, stale_is_late: bool) -> bytes | None:
        """The payload that answers the last datagram, or None when the time is over."""
        while (left_s := until_s - time.monotonic()) > 0:
            self._line.settimeout(min(left_s, _CHECK_S))
            try:
                data = self._line.recv(protocol.LARGEST_BYTES + 1)
            except ConnectionRefusedError:
                raise self._fail(self._exit_reason() or "nothing listens there any more") from None
            except TimeoutError:
                ended = self._exit_reason()
                if ended is not None:
                    raise self._fail(ended) from None
                continue
            try:
                answer = protocol.unpack(data)
            except DatagramError as error:
                raise self._fail(str(error)) from None
            if answer.kind is Kind.STOPPED:
                raise self._fail(f"it stopped: {protocol.unpack_reason(answer.payload)}")
            if answer.session != self._session:
                raise self._fail("an answer of another session came")
            if answer.sequence == self._sequence and answer.kind is wanted:
                return answer.payload
            if not (stale_is_late and answer.sequence < self._sequence):
                number = f"{answer.kind.name} {answer.sequence}"
                raise self._fail(f"{number} came late or again where {wanted.name} {self._sequence} was due")
        return None

    def _fail(self, problem: str) -> HardwareError:
        self._failure = f"{self._where}: {problem}; it is in a latched stop, run again to begin a new session"
        self._send_halt()
        return HardwareError(self._failure)

    def _send_halt(self) -> None:
        self._sequence += 1
        with suppress(OSError):  # where the other end is gone it cannot move either
            self._line.send(protocol.pack(Datagram(Kind.HALT, self._session, self._sequence)))
