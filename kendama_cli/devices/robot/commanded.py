"""A robot under the session of a commander: obeys its datagrams, answers them, and ignores everybody else's."""

from __future__ import annotations

from collections.abc import Callable

from kendama_cli.devices.robot import protocol
from kendama_cli.devices.robot.datagram_line import DatagramLine
from kendama_cli.devices.robot.interface import JointCommand, Robot, torque_interface
from kendama_cli.devices.robot.liveness import Address
from kendama_cli.devices.robot.protocol import Datagram, DatagramError, Kind, Report, Welcome
from kendama_cli.devices.robot.session import Place, Session
from kendama_cli.devices.robot.torque_protocol import TorqueReport, pack_torque_report, unpack_torque
from kendama_cli.errors import KendamaError
from kendama_cli.motion.impedance import JointTorque

Command = JointCommand | JointTorque


class CommandedRobot:
    """``take`` reads what a datagram commands, and answers every other one; ``move`` carries a command out.

    ``open_robot`` opens the robot, at once and again for every session after a stop, which no opened robot survives.
    """

    def __init__(
        self, open_robot: Callable[[], Robot], line: DatagramLine, secret: bytes, *, realtime: bool, watchdog_s: float
    ) -> None:
        self.robot = open_robot()
        self.session = Session(secret, may_skip=realtime)
        self.moving = False
        self._answered: bytes | None = None
        self._open_robot = open_robot
        self._line = line
        self._realtime = realtime
        self._watchdog_s = watchdog_s

    def period_s(self, command: Command | None) -> float:
        """How long the robot moves under ``command`` [s]."""
        torque = self.robot.torque if isinstance(command, JointTorque) else None
        return self.robot.period_s if torque is None else torque.period_s

    def take(self, data: bytes, sender: Address) -> Command | None:
        """The command to carry out, if that is what came; everything else is answered here, or ignored."""
        session = self.session
        datagram = session.authentic(data)
        if datagram is None:
            return None
        if datagram.kind is Kind.HELLO:
            self._send(session.challenge(datagram, moving=self.moving), sender)
        elif datagram.kind is Kind.OPEN and datagram.session != session.number:
            self._begin_session(datagram, sender)
        elif (place := session.place(datagram, sender)) is Place.REPEATED:
            if self._answered is not None:
                self._send(self._answered, sender)
        elif place is not Place.OLD:
            self._answered = None
            return self._next(datagram, place)
        return None

    def _next(self, datagram: Datagram, place: Place) -> Command | None:
        """The command to carry out, if ``datagram``, which is new, brings one."""
        session = self.session
        try:
            if place is Place.SKIPPING:
                due = session.counter + 1
                raise DatagramError(
                    f"{datagram.kind.name} {datagram.counter} came where {due} was due: a datagram is lost"
                )
            if session.stopped is None:
                return self._obey(datagram)
        except KendamaError as error:
            self.stop(str(error))
        self._refuse(datagram.counter)
        return None

    def _begin_session(self, opening: Datagram, sender: Address) -> None:
        if not self.session.begin(opening, sender, moving=self.moving):
            return
        if not self.session.is_first:
            self.robot.close()
            self.robot = self._open_robot()
        self.session.is_first = self.moving = False
        self._answer(Kind.WELCOME, opening.counter, _welcome(self.robot, self._realtime, self._watchdog_s))

    def _obey(self, datagram: Datagram) -> Command | None:
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
            report = Report(exchange, session.missed, session.ignored)
            self._answer(Kind.STATE, datagram.counter, protocol.pack_report(report))
            return None
        raise DatagramError("the commander sent HALT")

    def move(self, command: Command, *, answer: bool) -> None:
        """Have the robot carry out ``command``, and report it to the commander where ``answer``."""
        self.moving = True
        counter = self.session.counter
        try:
            kind, report = _exchange(self.robot, command, self.session)
        except KendamaError as error:
            self.stop(str(error))
            self._refuse(counter)
            return
        if answer:
            self._answer(kind, counter, report)

    def stop(self, reason: str) -> None:
        """Halt for good, because of ``reason``; the first reason is kept."""
        if self.session.stopped is None:
            self.session.stopped = reason
            self.moving = False
            self.robot.halt()

    def _refuse(self, counter: int) -> None:
        self._answer(Kind.STOPPED, counter, protocol.pack_reason(self.session.stopped or ""))

    def _answer(self, kind: Kind, counter: int, payload: bytes) -> None:
        self._answered = self.session.pack(kind, counter, payload)
        for sender in self.session.senders:
            self._send(self._answered, sender)

    def _send(self, data: bytes, receiver: Address) -> None:
        try:
            self._line.send(data, receiver)
        except OSError as error:
            self.stop(f"the line cannot be written to: {error}")


def _welcome(robot: Robot, realtime: bool, watchdog_s: float) -> bytes:
    torque_s = 0.0 if robot.torque is None else robot.torque.period_s
    return protocol.pack_welcome(
        Welcome(robot.joint_names, robot.limits, robot.period_s, realtime, watchdog_s, torque_s)
    )


def _exchange(robot: Robot, command: Command, session: Session) -> tuple[Kind, bytes]:
    """Have ``robot`` carry out ``command``; its report, packed."""
    if isinstance(command, JointTorque):
        done = torque_interface(robot, "a torque command").exchange(command)
        return Kind.TORQUE_STATE, pack_torque_report(TorqueReport(done, session.missed, session.ignored))
    return Kind.STATE, protocol.pack_report(Report(robot.exchange(command), session.missed, session.ignored))
