"""A robot under the session of a commander: obeys its datagrams, answers them, and ignores everybody else's."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from kendama_cli.devices.robot.interface import BrakingTorque, JointCommand, Robot, torque_interface
from kendama_cli.devices.robot.limiter import braked
from kendama_cli.devices.robot.udp import protocol
from kendama_cli.devices.robot.udp.datagram_line import DatagramLine
from kendama_cli.devices.robot.udp.liveness import Address
from kendama_cli.devices.robot.udp.protocol import Datagram, DatagramError, Kind, Report, Welcome
from kendama_cli.devices.robot.udp.session import Place, Session
from kendama_cli.devices.robot.udp.torque_protocol import TorqueReport, pack_torque_report, unpack_torque
from kendama_cli.errors import KendamaError
from kendama_cli.robot_model.joint_torque import JointTorque

Command = JointCommand | JointTorque
_BRAKING_S = 2.0
"""A robot that is not at rest so long after a stop is halted as it is."""
_STILL_RAD_S = 1e-2


class CommandedRobot:
    """``take`` reads what a datagram commands, and answers every other one; ``move`` carries a command out.

    ``open_robot`` opens the robot, at once and again for every session after a stop, which no opened robot survives.
    """

    def __init__(
        self, open_robot: Callable[[], Robot], line: DatagramLine, secret: bytes, *, realtime: bool, watchdog_s: float
    ) -> None:
        self.robot = open_robot()
        self.session = Session(secret, may_skip=realtime)
        self.moving = self.braking = False
        self._sent: Command | None = None
        self._answered: bytes | None = None
        self._open_robot = open_robot
        self._line = line
        self._realtime = realtime
        self._watchdog_s, self._stopped_s = watchdog_s, 0.0

    def period_s(self, command: Command | None) -> float:
        """Return the time for which the robot moves under ``command`` [s]."""
        torque = self.robot.torque if isinstance(command, JointTorque) else None
        return self.robot.period_s if torque is None else torque.period_s

    def take(self, data: bytes, sender: Address) -> Command | None:
        """Return the command to carry out, if ``data`` is one; everything else is answered here, or ignored."""
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
        """Return the command to carry out, if ``datagram``, which is new, brings one."""
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
        self.session.is_first = self.moving = self.braking = False
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
            self.moving, self._sent = False, None
            exchange = self.robot.reset(position, seed)
            session.ready = True
            report = Report(exchange, session.missed, session.ignored)
            self._answer(Kind.STATE, datagram.counter, protocol.pack_report(report))
            return None
        raise DatagramError("the commander sent HALT")

    def move(self, command: Command) -> None:
        """Have the robot carry out ``command``, and report it to the commander."""
        self.moving = True
        session = self.session
        try:
            if isinstance(command, JointTorque):
                torque = torque_interface(self.robot, "a torque command").exchange(command)
                self._sent, kind = torque.sent, Kind.TORQUE_STATE
                report = pack_torque_report(TorqueReport(torque, session.missed, session.ignored))
            else:
                done = self.robot.exchange(command)
                self._sent, kind = done.sent, Kind.STATE
                report = protocol.pack_report(Report(done, session.missed, session.ignored))
        except KendamaError as error:
            self.stop(str(error))
            self._refuse(session.counter)
            return
        self._answer(kind, session.counter, report)

    def brake(self) -> None:
        """Have the robot slow down within its limits for one period; after a stop, until it is at rest and halts."""
        robot, last, still = self.robot, self._sent, True
        try:
            if isinstance(last, JointCommand):
                slower = braked(last, robot.limits.acceleration_rad_s2, robot.period_s)
                self._sent = sent = robot.exchange(slower).sent
                still = not sent.velocity_rad_s.any()
            elif last is not None and isinstance(robot.torque, BrakingTorque):
                still = bool((np.abs(robot.torque.brake().state.velocity_rad_s) < _STILL_RAD_S).all())
        except KendamaError as error:
            self.stop(str(error))
            still = True
        if self.braking and (still or time.monotonic() - self._stopped_s > _BRAKING_S):
            self.braking = False
            self.robot.halt()

    def stop(self, reason: str) -> None:
        """Stop for good, because of ``reason``, the first of which is kept: a robot that moves by the clock brakes."""
        if self.session.stopped is None:
            self.session.stopped, self._stopped_s = reason, time.monotonic()
            self.braking = self._realtime and self.moving and self._sent is not None
            self.moving = False
            if not self.braking:
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
