"""The robot's end of the line: serves any robot to one commander at a time, and stops for good when the line errs.

A stop is latched: from then on every datagram is answered with STOPPED and its reason, and only a new session
(HELLO with a number never seen before, then RESET) leaves it. In lockstep the robot moves one control period per
COMMAND or TORQUE and the wall clock serves as a watchdog only; in real time it moves at every period of the wall clock,
holds the last command where none came in time, counts that, and stops after ``watchdog_s`` of silence.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable

from kendama_cli.devices.robot import protocol
from kendama_cli.devices.robot.interface import JointCommand, Robot, torque_interface
from kendama_cli.devices.robot.protocol import Datagram, DatagramError, Kind, Report, Welcome
from kendama_cli.devices.robot.torque_protocol import TorqueReport, pack_torque_report, unpack_torque
from kendama_cli.errors import KendamaError
from kendama_cli.motion.impedance import JointTorque

Address = tuple[str, int]
Command = JointCommand | JointTorque
ANSWERS = (Kind.WELCOME, Kind.STATE, Kind.STOPPED, Kind.TORQUE_STATE)
_CHECK_S = 0.5
"""How often a waiting server checks whether it should go on."""


class RobotServer:
    """Answers datagrams on ``line`` with what a robot does; ``serve`` returns when ``keep_going()`` is false.

    ``open_robot`` opens the robot, at once and again for every session after a stop, which no opened robot survives.
    """

    def __init__(
        self,
        open_robot: Callable[[], Robot],
        line: socket.socket,
        *,
        realtime: bool,
        watchdog_s: float,
        keep_going: Callable[[], bool] = lambda: True,
    ) -> None:
        self.stopped: str | None = "no session has begun"
        self._open_robot = open_robot
        self._robot = open_robot()
        self._line = line
        self._realtime = realtime
        self._watchdog_s = watchdog_s
        self._keep_going = keep_going
        self._n = len(self._robot.joint_names)
        self._sessions: set[int] = set()
        self._session = 0
        self._peer: Address | None = None
        self._sequence = 0
        self._ready = False
        self._moving = False
        self._missed = 0
        self._held: Command | None = None
        self._received_s = 0.0
        self._tick_s = 0.0

    def serve(self) -> None:
        """Answer until ``keep_going()`` is false; the robot is closed on the way out."""
        try:
            while self._keep_going():
                if self._realtime and self._moving:
                    self._one_period()
                else:
                    self._one_answer()
        finally:
            self._robot.close()

    def _one_answer(self) -> None:
        received = self._receive(min(_CHECK_S, self._watchdog_s))
        if received is None:
            self._check_silence()
            return
        command = self._take(*received)
        if command is not None and not self._realtime:
            self._move(command, answer=True)
        elif command is not None:
            self._held = command
            self._tick_s = time.monotonic()
            self._move(command, answer=True)

    def _one_period(self) -> None:
        torque = self._robot.torque if isinstance(self._held, JointTorque) else None
        period_s = self._robot.period_s if torque is None else torque.period_s
        self._tick_s = max(self._tick_s + period_s, time.monotonic() - period_s)
        fresh: Command | None = None
        while True:
            left_s = self._tick_s - time.monotonic()
            received = self._receive(max(left_s, 0.0))
            if received is not None:
                taken = self._take(*received)
                self._missed += taken is not None and fresh is not None
                fresh = taken or fresh
            elif left_s <= 0:
                break
            if not self._moving:
                return
        if fresh is not None:
            self._held = fresh
            self._move(fresh, answer=True)
            return
        self._missed += 1
        self._check_silence()
        if self._moving and self._held is not None:
            self._move(self._held, answer=False)

    def _receive(self, timeout_s: float) -> tuple[bytes, Address] | None:
        self._line.settimeout(timeout_s)
        try:
            data, sender = self._line.recvfrom(protocol.LARGEST_BYTES + 1)
        except (TimeoutError, BlockingIOError, ConnectionError):
            return None
        return data, sender

    def _take(self, data: bytes, sender: Address) -> Command | None:
        """The command to carry out, if that is what came; everything else is answered here."""
        try:
            datagram = protocol.unpack(data)
        except DatagramError as error:
            self._stop(f"{error} (from {sender[0]}:{sender[1]})")
            self._refuse(sender, Datagram(Kind.HELLO, self._session if sender == self._peer else 0, 0))
            return None
        if datagram.kind in ANSWERS:  # never answer, never obey
            self._stop(f"{datagram.kind.name} came from {sender[0]}:{sender[1]}, where only commands belong")
            return None
        if datagram.kind is Kind.HELLO:
            self._begin_session(datagram, sender)
            return None
        if self.stopped is None:
            self._check_order(datagram, sender)
        if self.stopped is not None:
            self._refuse(sender, datagram)
            return None
        self._missed += datagram.sequence - self._sequence - 1
        self._sequence = datagram.sequence
        self._received_s = time.monotonic()
        try:
            return self._obey(datagram)
        except (DatagramError, KendamaError) as error:
            self._stop(str(error))
            self._refuse(sender, datagram)
            return None

    def _begin_session(self, datagram: Datagram, sender: Address) -> None:
        known = datagram.session in self._sessions
        if self.stopped is None or known:
            what = "a repeated HELLO" if known else "the HELLO of another session"
            self._stop(f"{what} came from {sender[0]}:{sender[1]} while a session was open")
            self._refuse(sender, datagram)
            return
        if self._sessions:
            self._robot.close()
            self._robot = self._open_robot()
        self._sessions.add(datagram.session)
        self._session, self._peer, self._sequence = datagram.session, sender, datagram.sequence
        self._ready, self._moving, self._missed, self.stopped = False, False, 0, None
        robot = self._robot
        torque_s = 0.0 if robot.torque is None else robot.torque.period_s
        welcome = Welcome(robot.joint_names, robot.limits, robot.period_s, self._realtime, self._watchdog_s, torque_s)
        self._answer(Kind.WELCOME, datagram, protocol.pack_welcome(welcome), sender)

    def _check_order(self, datagram: Datagram, sender: Address) -> None:
        ahead = datagram.sequence - self._sequence
        if sender != self._peer:
            self._stop(f"a foreign {datagram.kind.name} came from {sender[0]}:{sender[1]}")
        elif datagram.session != self._session:
            self._stop(f"a {datagram.kind.name} of another session came")
        elif ahead <= 0:
            self._stop(f"{datagram.kind.name} {datagram.sequence} came late or again; {self._sequence + 1} was due")
        elif ahead > 1 and not self._realtime:
            self._stop(
                f"{datagram.kind.name} {datagram.sequence} came where {self._sequence + 1} was due: a datagram is lost"
            )

    def _obey(self, datagram: Datagram) -> Command | None:
        if datagram.kind in (Kind.COMMAND, Kind.TORQUE):
            unpack = protocol.unpack_command if datagram.kind is Kind.COMMAND else unpack_torque
            command: Command = unpack(datagram.payload, self._n)
            if not self._ready:
                raise DatagramError(f"{datagram.kind.name} came before the first RESET")
            return command
        peer = self._peer
        assert peer is not None
        if datagram.kind is Kind.RESET:
            position, seed = protocol.unpack_reset(datagram.payload, self._n)
            self._moving = False
            exchange = self._robot.reset(position, seed)
            self._ready = True
            self._answer(Kind.STATE, datagram, protocol.pack_report(Report(exchange, self._missed)), peer)
        else:
            self._stop("the commander sent HALT")
            self._refuse(peer, datagram)
        return None

    def _move(self, command: Command, *, answer: bool) -> None:
        peer = self._peer
        assert peer is not None
        self._moving = True
        asked = Datagram(Kind.COMMAND, self._session, self._sequence)
        try:
            kind, payload = self._exchange(command)
        except KendamaError as error:
            self._stop(str(error))
            self._refuse(peer, asked)
            return
        if answer:
            self._answer(kind, asked, payload, peer)

    def _exchange(self, command: Command) -> tuple[Kind, bytes]:
        if isinstance(command, JointTorque):
            done = torque_interface(self._robot, "a torque command").exchange(command)
            return Kind.TORQUE_STATE, pack_torque_report(TorqueReport(done, self._missed))
        return Kind.STATE, protocol.pack_report(Report(self._robot.exchange(command), self._missed))

    def _check_silence(self) -> None:
        if self._moving and time.monotonic() - self._received_s > self._watchdog_s:
            self._stop(f"no datagram came for {self._watchdog_s:g} s while moving")

    def _stop(self, reason: str) -> None:
        if self.stopped is None:
            self.stopped = reason
            self._moving = False
            self._robot.halt()

    def _refuse(self, sender: Address, datagram: Datagram) -> None:
        self._answer(Kind.STOPPED, datagram, protocol.pack_reason(self.stopped or ""), sender)

    def _answer(self, kind: Kind, to: Datagram, payload: bytes, sender: Address) -> None:
        try:
            self._line.sendto(protocol.pack(Datagram(kind, to.session, to.sequence, payload)), sender)
        except OSError as error:
            self._stop(f"the line cannot be written to: {error}")
