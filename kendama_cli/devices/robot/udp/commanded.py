"""A robot under the session of a commander: obeys its datagrams, answers them, and ignores everybody else's."""

from __future__ import annotations

import time
from collections.abc import Callable
from enum import Enum

from kendama_cli.devices.robot.interface import JointCommand, Robot
from kendama_cli.devices.robot.limiter import braked
from kendama_cli.devices.robot.udp import protocol
from kendama_cli.devices.robot.udp.datagram_line import Address, DatagramLine, has_socket
from kendama_cli.devices.robot.udp.protocol import Datagram, DatagramError, Kind, Report, Welcome
from kendama_cli.devices.robot.udp.seal import (
    NONCE_BYTES,
    ForeignDatagramError,
    Seal,
    fresh_nonce,
    read_header,
    session_number,
    session_seal,
)
from kendama_cli.errors import KendamaError

COMMANDS = (Kind.RESET, Kind.COMMAND, Kind.HALT)
LET_GO_S = 60.0
"""A commander on another machine that was silent for so long, its robot at rest, has let go when another one asks."""
_SENDERS = 4
"""So many are answered at once, at most."""
_LOOK_S = 0.5
"""Shortest time between two checks that the commander still lives."""


class Order(Enum):
    """Position of a datagram in the order of its session."""

    NEXT = "next"
    REPEATED = "the newest one again"
    OLD = "older than the newest one"
    SKIPPING = "after one that never came"


class Session:
    """The open session, or in ``stopped`` the reason why none is open; one commander has it until it lets go.

    With ``may_skip`` a lost datagram is counted in ``missed``, as in real time. ``ignored`` counts the datagrams that
    were no commander's, or came again. ``senders`` are those from whom the newest datagram came: whoever hears one may
    send it on sooner than the commander's own arrives, and must not be the only one that is answered.
    """

    def __init__(self, secret: bytes, *, may_skip: bool) -> None:
        self.stopped: str | None = "no session has begun"
        self.senders: list[Address] = []
        self.number = self.counter = self.missed = self.ignored = 0
        self.ready = self.is_first = True
        self.heard_s = 0.0
        self._secret, self._greeting = secret, Seal(secret)
        self._seal = self._greeting
        self._nonce = fresh_nonce()
        self._may_skip = may_skip
        self._looked_s, self._lives = float("-inf"), True

    def authentic(self, data: bytes) -> Datagram | None:
        """Return a datagram of the commander, or of who wants to be it; None for all others, which are only counted."""
        header = read_header(data)
        try:
            if header is not None:
                kind, number, _ = header
                if kind is Kind.HELLO:
                    return self._greeting.unpack(data)
                if kind is Kind.OPEN and number == session_number(self._nonce):
                    return session_seal(self._secret, data[-NONCE_BYTES - 16 : -16], self._nonce).unpack(data)
                if (kind in COMMANDS or kind is Kind.OPEN) and number == self.number and self.senders:
                    return self._seal.unpack(data)
        except ForeignDatagramError:
            pass
        self.ignored += 1
        return None

    def challenge(self, hello: Datagram, *, moving: bool) -> bytes:
        """Return the answer to ``hello``: the nonce for the next OPEN, and the session that is open."""
        number = self.number if self._is_held(moving) else 0
        return self._greeting.pack(Datagram(Kind.CHALLENGE, number, 0, hello.payload[:NONCE_BYTES] + self._nonce))

    def begin(self, opening: Datagram, sender: Address, *, moving: bool) -> bool:
        """Open the session of ``opening``, unless a commander has one; obeyed from its first RESET on (``ready``)."""
        if opening.session == self.number or len(opening.payload) != NONCE_BYTES or self._is_held(moving):
            self.ignored += 1
            return False
        self._seal = session_seal(self._secret, opening.payload, self._nonce)
        self._nonce = fresh_nonce()
        self.number, self.senders, self.counter = opening.session, [sender], opening.counter
        self.ready, self.missed, self.stopped, self.heard_s = False, 0, None, time.monotonic()
        self._looked_s, self._lives = self.heard_s, True
        return True

    def order(self, datagram: Datagram, sender: Address) -> Order:
        """Return the order of ``datagram``; the next one is taken, and those missing before it are counted."""
        ahead = datagram.counter - self.counter
        if ahead < 0:
            self.ignored += 1
            return Order.OLD
        if ahead == 0:
            if sender not in self.senders:
                self.senders = [*self.senders[-_SENDERS + 1 :], sender]
            return Order.REPEATED
        if ahead > 1 and not self._may_skip:
            return Order.SKIPPING
        self.missed += ahead - 1
        self.counter, self.heard_s, self.senders = datagram.counter, time.monotonic(), [sender]
        return Order.NEXT

    def pack(self, kind: Kind, counter: int, payload: bytes) -> bytes:
        """Pack an answer of this session."""
        return self._seal.pack(Datagram(kind, self.number, counter, payload))

    def _is_held(self, moving: bool) -> bool:
        """Return True if a commander has the session and does not show to be gone."""
        if self.stopped is not None or not self.senders:
            return False
        now_s = time.monotonic()
        if now_s - self._looked_s >= _LOOK_S:
            lives = has_socket(self.senders[0])
            silent = not moving and now_s - self.heard_s >= LET_GO_S
            self._looked_s, self._lives = now_s, not silent if lives is None else lives
        return self._lives


_BRAKING_S = 2.0
"""A robot that is not at rest so long after a stop is halted as it is."""


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
        self._sent: JointCommand | None = None
        self._answered: bytes | None = None
        self._open_robot = open_robot
        self._line = line
        self._realtime = realtime
        self._watchdog_s, self._stopped_s = watchdog_s, 0.0

    def take(self, data: bytes, sender: Address) -> JointCommand | None:
        """Return the command to carry out, if ``data`` is one; everything else is answered here, or ignored."""
        session = self.session
        datagram = session.authentic(data)
        if datagram is None:
            return None
        if datagram.kind is Kind.HELLO:
            self._send(session.challenge(datagram, moving=self.moving), sender)
        elif datagram.kind is Kind.OPEN and datagram.session != session.number:
            self._begin_session(datagram, sender)
        elif (order := session.order(datagram, sender)) is Order.REPEATED:
            if self._answered is not None:
                self._send(self._answered, sender)
        elif order is not Order.OLD:
            self._answered = None
            return self._next(datagram, order)
        return None

    def _next(self, datagram: Datagram, order: Order) -> JointCommand | None:
        """Return the command to carry out, if ``datagram``, which is new, brings one."""
        session = self.session
        try:
            if order is Order.SKIPPING:
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
        limits = (self.robot.limits, self.robot.period_s, self._realtime, self._watchdog_s)
        self._answer(Kind.WELCOME, opening.counter, protocol.pack_welcome(Welcome(self.robot.joint_names, *limits)))

    def _obey(self, datagram: Datagram) -> JointCommand | None:
        session, n = self.session, len(self.robot.joint_names)
        if datagram.kind is Kind.COMMAND:
            command = protocol.unpack_command(datagram.payload, n)
            if not session.ready:
                raise DatagramError("COMMAND came before the first RESET")
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

    def move(self, command: JointCommand) -> None:
        """Have the robot carry out ``command``, and report it to the commander."""
        self.moving = True
        session = self.session
        try:
            done = self.robot.exchange(command)
        except KendamaError as error:
            self.stop(str(error))
            self._refuse(session.counter)
            return
        self._sent = done.sent
        self._answer(Kind.STATE, session.counter, protocol.pack_report(Report(done, session.missed, session.ignored)))

    def brake(self) -> None:
        """Have the robot slow down within its limits for one period; after a stop, until it is at rest and halts."""
        robot, last, still = self.robot, self._sent, True
        try:
            if last is not None:
                slower = braked(last, robot.limits.acceleration_rad_s2, robot.period_s)
                self._sent = sent = robot.exchange(slower).sent
                still = not sent.velocity_rad_s.any()
        except KendamaError as error:
            self.stop(str(error))
            still = True
        if self.braking and (still or time.monotonic() - self._stopped_s > _BRAKING_S):
            self.braking = False
            self.robot.halt()

    def stop(self, reason: str) -> None:
        """Stop for good, because of ``reason``, the first of which stays: a robot that moves by the clock brakes."""
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
