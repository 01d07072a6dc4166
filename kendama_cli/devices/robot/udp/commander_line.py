"""The commander's end of a line: greets, asks, repeats what was not answered, accepts the robot's answers alone."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from contextlib import suppress

from kendama_cli.devices.robot.udp import protocol
from kendama_cli.devices.robot.udp.datagram_line import has_socket
from kendama_cli.devices.robot.udp.protocol import Datagram, Kind
from kendama_cli.devices.robot.udp.seal import NONCE_BYTES, ForeignDatagramError, Seal, fresh_nonce, session_seal
from kendama_cli.errors import HardwareError

_AGAIN_S, _MAX_AGAIN_S = 0.05, 1.0
"""What was not answered is sent again after the first, then after twice as long each time, up to the second."""
_ASK_WHO_S = 2.0
"""After so long without an answer it is asked whether the session is still open there."""
_HELD_S = 1.5
"""So long a robot that another commander has is asked again: that one may just have ended."""
MAX_WAIT_S = 120.0
"""Nobody is waited for longer: no RESET takes so long, no process that lives is suspended or busy for so long."""
_HALTS = 3
"""HALT waits for no answer, so that it is sent so often."""


STOPPED = "it is in a latched stop, run again to begin a new session"
NOT_THERE = "start it ('kendama robot twin', or its controller), or look at hardware.host and hardware.port"


class Peer:
    """A socket connected to ``host:port``; ``fail`` makes the error of a problem that has been met.

    ``exit_reason`` says how a process that we started ended, None while it lives; without it the socket of a process
    on this machine shows it. Raises HardwareError where the address is none.
    """

    def __init__(
        self, host: str, port: int, exit_reason: Callable[[], str | None] | None, fail: Callable[[str], HardwareError]
    ) -> None:
        self._exit_reason, self._fail = exit_reason, fail
        try:
            family, kind, proto, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._line = socket.socket(family, kind, proto)
            self._line.connect(address)  # the kernel then drops whatever a foreign sender sends us
        except OSError as error:
            raise HardwareError(f"the robot at {host}:{port} cannot be reached: {error}") from None
        self._address = (str(address[0]), int(address[1]))

    def send(self, data: bytes) -> None:
        """Send ``data``; raises HardwareError."""
        try:
            self._line.send(data)
        except ConnectionRefusedError:
            raise self._fail(self.ended() or "nothing listens there") from None
        except OSError as error:
            raise self._fail(f"the line cannot be written to: {error}") from None

    def send_anyway(self, data: bytes) -> None:
        """Send ``data`` where that can be done: where the other end is gone it cannot move either."""
        with suppress(OSError):
            self._line.send(data)

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the next message, None where there is none; raises HardwareError."""
        self._line.settimeout(timeout_s)
        try:
            return self._line.recv(protocol.MAX_BYTES + 1)
        except ConnectionRefusedError:
            raise self._fail(self.ended() or "nothing listens there") from None
        except (TimeoutError, BlockingIOError):
            return None

    def ended(self) -> str | None:
        """Return how the process ended; None where it lives, or cannot be seen."""
        if self._exit_reason is not None:
            return self._exit_reason()
        return "nothing listens there" if has_socket(self._address) is False else None

    def seen_to_live(self) -> bool:
        """Return True if the process is known to be there, though perhaps suspended or busy."""
        if self._exit_reason is not None:
            return self._exit_reason() is None
        return has_socket(self._address) is True

    def close(self) -> None:
        """Let go of the socket."""
        self._line.close()


class CommanderLine:
    """A session with the robot at ``host:port``; the first fault raises HardwareError, halts the robot, and stays.

    Silence is counted only while this process listens, and only for ``silence_s``; not at all where the other process
    can be seen to live and waits for us (``lockstep``): it may be suspended, or busy. Nobody is waited for longer than
    MAX_WAIT_S. ``exit_reason`` says how a process that we started ended, None while it lives; without it the
    socket of a process on this machine shows it.
    """

    def __init__(
        self, host: str, port: int, secret: bytes, *, silence_s: float, exit_reason: Callable[[], str | None] | None
    ) -> None:
        self.where = f"the robot at {host}:{port}"
        self.failure: str | None = None
        self.ignored = 0
        self.lockstep = exit_reason is not None  # until the robot says how it keeps time
        self._silence_s = silence_s
        self._greeting = self._seal = Seal(secret)
        self._secret, self._nonce, self._reminder = secret, fresh_nonce(), b""
        self._number = self._counter = 0
        self._peer = Peer(host, port, exit_reason, self.fail)

    def greet(self) -> bytes:
        """Begin a session; the payload of the robot's WELCOME."""
        try:
            robot_nonce = self._challenge()
            self._seal = session_seal(self._secret, self._nonce, robot_nonce)
            return self.ask(Kind.OPEN, self._nonce, Kind.WELCOME)
        except HardwareError:
            self._peer.close()
            raise

    def ask(self, kind: Kind, payload: bytes, expected: Kind, *, hold_s: float = 0.0, at_most_s: float = 0.0) -> bytes:
        """Return the payload that answers; with ``hold_s`` another datagram goes out after that time, else the same."""
        if self.failure is not None:
            raise HardwareError(self.failure)
        waited_s, wait_s, listened_s = 0.0, hold_s or _AGAIN_S, 0.0
        self._counter += 1
        while True:
            self._peer.send(self._seal.pack(Datagram(kind, self._number, self._counter, payload)))
            if isinstance(answer := self._await(expected, wait_s), bytes):
                return answer
            waited_s, listened_s = 0.0 if answer is Kind.WORKING else waited_s + wait_s, listened_s + wait_s
            asked = f"{kind.name} {self._counter}"
            self._judge_silence(asked, waited_s, at_most_s or self._silence_s, listened_s)
            if hold_s:
                self._counter += 1
            else:
                wait_s = min(2 * wait_s, _MAX_AGAIN_S)

    def fail(self, problem: str) -> HardwareError:
        """Halt the robot for good, because of ``problem``."""
        self.failure = f"{self.where}: {problem}; {STOPPED if self._number else NOT_THERE}"
        self._send_halt()
        return HardwareError(self.failure)

    def halt(self) -> None:
        """Stop the robot and stay stopped; idempotent, never raises."""
        if self.failure is None:
            self.failure = f"{self.where} was halted from here"
            self._send_halt()

    def close(self) -> None:
        """Halt and let go of the line."""
        self.halt()
        self._peer.close()

    def _challenge(self) -> bytes:
        """Ask for the robot's nonce; the number of the session to begin is stored."""
        hello = self._greeting.pack(Datagram(Kind.HELLO, 0, 0, self._nonce))
        waited_s, held_s, wait_s = 0.0, 0.0, _AGAIN_S
        while True:
            self._peer.send(hello)
            answer = self._await(Kind.CHALLENGE, wait_s)
            if isinstance(answer, bytes) and self._number == 0:
                self._number = int.from_bytes(answer[:8], "little")
                return answer
            if isinstance(answer, bytes):
                if held_s >= _HELD_S:
                    raise self.fail("another commander has it, and has not let go")
                time.sleep(wait_s)
                held_s, waited_s = held_s + wait_s, 0.0
            else:
                self._judge_silence("HELLO", waited_s := waited_s + wait_s, self._silence_s, waited_s)
            wait_s = min(2 * wait_s, _MAX_AGAIN_S)

    def _await(self, expected: Kind, wait_s: float) -> bytes | Kind | None:
        """Return the payload that answers the last datagram, WORKING if the robot says so, None if neither came.

        What has come is read even when the time is over: it may be over because this process was stopped.
        """
        until_s = time.monotonic() + wait_s
        working: Kind | None = None
        while (left_s := until_s - time.monotonic()) > -wait_s:
            data = self._peer.receive(max(left_s, 0.0))
            if data is None:
                return working
            answer = self._believed(data, expected)
            if answer is None:
                continue
            if answer.kind is Kind.STOPPED:
                raise self.fail(f"it stopped: {protocol.unpack_reason(answer.payload)}")
            if answer.kind is expected:
                return answer.payload
            if answer.kind is not Kind.WORKING:
                raise self.fail(f"{answer.kind.name} {answer.counter} came where {expected.name} was due")
            working = Kind.WORKING
        return working

    def _believed(self, data: bytes, expected: Kind) -> Datagram | None:
        """Return the robot's answer to the last datagram; None for a foreign or late one, which is counted."""
        for seal in (self._seal, self._greeting):
            with suppress(ForeignDatagramError):
                answer = seal.unpack(data)
                if answer.kind is Kind.CHALLENGE:
                    return self._challenged(answer, expected)
                newest = answer.counter == self._counter or answer.kind is Kind.STOPPED
                return answer if newest and answer.session == self._number else None
        self.ignored += 1
        return None

    def _challenged(self, answer: Datagram, expected: Kind) -> Datagram | None:
        """Return the awaited challenge; raises HardwareError if the robot, asked, has another session open."""
        asked, nonce = answer.payload[:NONCE_BYTES], answer.payload[NONCE_BYTES:]
        if expected is Kind.CHALLENGE and asked == self._nonce and len(nonce) == NONCE_BYTES:
            self._number = answer.session
            return Datagram(answer.kind, answer.session, 0, nonce)
        if asked == self._reminder and answer.session != self._number:
            raise self.fail("it knows this session no more: it was started anew, or took another commander")
        return None

    def _judge_silence(self, asked: str, waited_s: float, at_most_s: float, listened_s: float) -> None:
        """Raise HardwareError where nobody can be there any more."""
        if (ended := self._peer.ended()) is not None:
            raise self.fail(ended)
        if listened_s <= MAX_WAIT_S and self.lockstep and self._peer.seen_to_live():
            if waited_s >= _ASK_WHO_S:
                self._reminder = fresh_nonce()
                self._peer.send(self._greeting.pack(Datagram(Kind.HELLO, 0, 0, self._reminder)))
        elif waited_s >= at_most_s or listened_s > MAX_WAIT_S:
            hint = "; has it the same key?" if asked == "HELLO" else ""
            limit_s = at_most_s if waited_s >= at_most_s else MAX_WAIT_S
            raise self.fail(f"no answer to {asked} within {limit_s:g} s{hint}")

    def _send_halt(self) -> None:
        self._counter += 1
        for _ in range(_HALTS):
            self._peer.send_anyway(self._seal.pack(Datagram(Kind.HALT, self._number, self._counter)))
