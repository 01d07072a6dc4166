"""A robot under the session of a commander: obeys its datagrams, answers them, and stops for good when one errs."""

from __future__ import annotations

import time
from collections.abc import Callable

from kendama_cli.devices.robot import protocol
from kendama_cli.devices.robot.datagram_line import Address, DatagramLine
from kendama_cli.devices.robot.interface import JointCommand, Robot, torque_interface
from kendama_cli.devices.robot.protocol import Datagram, DatagramError, Kind, Report, Welcome
from kendama_cli.devices.robot.session import Session
from kendama_cli.devices.robot.torque_protocol import TorqueReport, pack_torque_report, unpack_torque
from kendama_cli.errors import KendamaError
from kendama_cli.motion.impedance import JointTorque

Command = JointCommand | JointTorque
ANSWERS = (Kind.WELCOME, Kind.STATE, Kind.STOPPED, Kind.TORQUE_STATE)


class CommandedRobot:
    """``take`` reads what a datagram commands, and answers every other one; ``move`` carries a command out.

    ``open_robot`` opens the robot, at once and again for every session after a stop, which no opened robot survives.
    """

    def __init__(
        self, open_robot: Callable[[], Robot], line: DatagramLine, *, realtime: bool, watchdog_s: float
    ) -> None:
        self.robot = open_robot()
        self.session = Session(may_skip=realtime)
        self.moving = False
        self.received_s = 0.0
        self._open_robot = open_robot
        self._line = line
        self._realtime = realtime
        self._watchdog_s = watchdog_s

    def period_s(self, command: Command | None) -> float:
        """How long the robot moves under ``command`` [s]."""
        torque = self.robot.torque if isinstance(command, JointTorque) else None
        return self.robot.period_s if torque is None else torque.period_s

    def take(self, data: bytes, sender: Address) -> Command | None:
        """The command to carry out, if that is what came; everything else is answered here."""
        session = self.session
        try:
            datagram = protocol.unpack(data)
        except DatagramError as error:
            self.stop(f"{error} (from {sender[0]}:{sender[1]})")
            self._refuse(sender, Datagram(Kind.HELLO, session.number if sender == session.peer else 0, 0))
            return None
        if datagram.kind in ANSWERS:  # never answer, never obey
            self.stop(f"{datagram.kind.name} came from {sender[0]}:{sender[1]}, where only commands belong")
            return None
        if datagram.kind is Kind.HELLO:
            self._begin_session(datagram, sender)
            return None
        disorder = None if session.stopped is not None else session.disorder(datagram, sender)
        if disorder is not None:
            self.stop(disorder)
        if session.stopped is not None:
            self._refuse(sender, datagram)
            return None
        session.take(datagram)
        self.received_s = time.monotonic()
        try:
            return self._obey(datagram, sender)
        except (DatagramError, KendamaError) as error:
            self.stop(str(error))
            self._refuse(sender, datagram)
            return None

    def _begin_session(self, hello: Datagram, sender: Address) -> None:
        refused = self.session.refused(hello, sender)
        if refused is not None:
            self.stop(refused)
            self._refuse(sender, hello)
            return
        if not self.session.is_first:
            self.robot.close()
            self.robot = self._open_robot()
        self.moving = False
        self.session.begin(hello, sender)
        self._answer(Kind.WELCOME, hello, _welcome(self.robot, self._realtime, self._watchdog_s), sender)

    def _obey(self, datagram: Datagram, peer: Address) -> Command | None:
        session, n = self.session, len(self.robot.joint_names)
        if datagram.kind in (Kind.COMMAND, Kind.TORQUE):
            unpack = protocol.unpack_command if datagram.kind is Kind.COMMAND else unpack_torque
            command: Command = unpack(datagram.payload, n)
            if not session.ready:
                raise DatagramError(f"{datagram.kind.name} came before the first RESET")
            return command
        if datagram.kind is Kind.RESET:
            position, seed = protocol.unpack_reset(datagram.payload, n)
            self.moving = False
            exchange = self.robot.reset(position, seed)
            session.ready = True
            self._answer(Kind.STATE, datagram, protocol.pack_report(Report(exchange, session.missed)), peer)
        else:
            self.stop("the commander sent HALT")
            self._refuse(peer, datagram)
        return None

    def move(self, command: Command, *, answer: bool) -> None:
        """Have the robot carry out ``command``, and report it to the commander where ``answer``."""
        peer = self.session.peer
        assert peer is not None
        self.moving = True
        asked = Datagram(Kind.COMMAND, self.session.number, self.session.sequence)
        try:
            kind, report = _exchange(self.robot, command, self.session.missed)
        except KendamaError as error:
            self.stop(str(error))
            self._refuse(peer, asked)
            return
        if answer:
            self._answer(kind, asked, report, peer)

    def stop(self, reason: str) -> None:
        """Halt for good, because of ``reason``; the first reason is kept."""
        if self.session.stopped is None:
            self.session.stopped = reason
            self.moving = False
            self.robot.halt()

    def _refuse(self, sender: Address, datagram: Datagram) -> None:
        self._answer(Kind.STOPPED, datagram, protocol.pack_reason(self.session.stopped or ""), sender)

    def _answer(self, kind: Kind, to: Datagram, payload: bytes, receiver: Address) -> None:
        try:
            self._line.send(Datagram(kind, to.session, to.sequence, payload), receiver)
        except OSError as error:
            self.stop(f"the line cannot be written to: {error}")


def _welcome(robot: Robot, realtime: bool, watchdog_s: float) -> bytes:
    torque_s = 0.0 if robot.torque is None else robot.torque.period_s
    return protocol.pack_welcome(
        Welcome(robot.joint_names, robot.limits, robot.period_s, realtime, watchdog_s, torque_s)
    )


def _exchange(robot: Robot, command: Command, missed: int) -> tuple[Kind, bytes]:
    """Have ``robot`` carry out ``command``; its report, packed."""
    if isinstance(command, JointTorque):
        done = torque_interface(robot, "a torque command").exchange(command)
        return Kind.TORQUE_STATE, pack_torque_report(TorqueReport(done, missed))
    return Kind.STATE, protocol.pack_report(Report(robot.exchange(command), missed))
