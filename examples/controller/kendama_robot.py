"""The robot's end of docs/reference/protocol.md, for a controller in Python: one file, standard library only."""

from __future__ import annotations

import enum
import hmac
import math
import secrets
import socket
import struct
import time
from dataclasses import dataclass, field
from hashlib import blake2s
from pathlib import Path

VERSION, LARGEST, LET_GO_S, MOST_SENDERS, NAN3 = 5, 4096, 60.0, 4, (math.nan,) * 3
HELLO, CHALLENGE, OPEN, WELCOME, RESET, COMMAND, STATE, HALT, STOPPED, WORKING = *range(1, 10), 12
HEADER = struct.Struct("<4sHHQQ")


def read_key(path: str) -> bytes:
    """Read the 32 bytes of a key file."""
    return bytes.fromhex(Path(path).expanduser().read_text())


def tag(key: bytes, data: bytes) -> bytes:
    """Proof of having ``key``, for behind ``data``."""
    return blake2s(data, key=key, digest_size=16).digest()


class Heard(enum.Enum):
    """Datagram that ``poll`` has heard; to a RESET and a COMMAND ``answer`` is due."""

    NOTHING, RESET, COMMAND, STOP = range(4)


@dataclass
class Command:
    """The wanted joints at the end of the coming period; of a RESET the position alone."""

    position_rad: tuple[float, ...]
    velocity_rad_s: tuple[float, ...] = ()
    acceleration_rad_s2: tuple[float, ...] = ()
    effort_nm: tuple[float, ...] = ()


@dataclass
class State:
    """Commands as sent to the motors, and the sensors' readings; cup and ball in the world, NaN if not tracked."""

    t_s: float
    sent: Command
    position_rad: tuple[float, ...]
    velocity_rad_s: tuple[float, ...]
    effort_nm: tuple[float, ...]
    wrist_wrench: tuple[float, ...] = (0.0,) * 6
    cup_m: tuple[float, ...] = NAN3
    ball_m: tuple[float, ...] = NAN3
    caught: bool = False


@dataclass
class Description:
    """Description of the robot; limits are n numbers each: lower, upper, velocity, acceleration, effort."""

    joint_names: tuple[str, ...]
    limits: tuple[tuple[float, ...], ...]
    period_s: float
    watchdog_s: float
    realtime: bool = True


@dataclass
class Robot:
    """One commander at a time; call ``poll`` every period, and ``answer`` once to what it has heard."""

    port: int
    key: bytes
    about: Description
    host: str = "127.0.0.1"
    reason: str | None = field(default="no session has begun", init=False)  # to hold; None while commanded
    command: Command = field(default_factory=lambda: Command(()), init=False)
    missed: int = field(default=0, init=False)
    ignored: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self.line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.line.bind((self.host, self.port))
        self.nonce, self.session_key, self.answered = secrets.token_bytes(16), b"", b""
        self.session, self.counter, self.heard_s, self.senders = 0, 0, 0.0, list[tuple[str, int]]()
        self.moving, self.ready, self.last = False, False, HALT

    def poll(self, timeout_s: float = 0.0) -> Heard:
        """Sort out what has come; waits no longer than ``timeout_s`` for more."""
        until_s = time.monotonic() + timeout_s
        for _ in range(1000):  # nobody keeps the controller busy by sending much
            if self.moving and self.about.realtime and time.monotonic() - self.heard_s > self.about.watchdog_s:
                self.stop(f"no datagram came for {self.about.watchdog_s:g} s while moving")
                return Heard.STOP
            self.line.settimeout(max(until_s - time.monotonic(), 0.0))
            try:
                data, sender = self.line.recvfrom(LARGEST + 1)
            except (BlockingIOError, TimeoutError, ConnectionError):
                return Heard.NOTHING
            heard = self._take(data, sender)
            if heard is not Heard.NOTHING:
                return heard
        return Heard.NOTHING

    def answer(self, state: State) -> None:
        """Answer the RESET or COMMAND that was heard last, once; a stop has answered it already."""
        if self.answered or self.reason is not None:
            return
        sent, n = state.sent, len(self.about.joint_names)
        parts = (sent.position_rad, sent.velocity_rad_s, sent.acceleration_rad_s2, sent.effort_nm)
        values = [value for part in parts for value in part or (0.0,) * n]
        for part in (state.position_rad, state.velocity_rad_s, state.effort_nm, state.wrist_wrench):
            values += part
        values += [*state.cup_m, *state.ball_m, *[math.nan] * (n + 15)]
        head = struct.pack("<dIIB", state.t_s, self.missed % 2**32, self.ignored % 2**32, state.caught)
        self.ready = True
        self._say(STATE, head + struct.pack(f"<{len(values)}d", *values))

    def stop(self, reason: str) -> None:
        """Latch a stop until another session begins; it answers what was not answered."""
        self.reason, self.moving, self.ready = self.reason or reason, False, False
        if not self.answered:
            self._say(STOPPED, self.reason.encode()[:400])

    def _take(self, data: bytes, sender: tuple[str, int]) -> Heard:
        kind = session = counter = -1
        if len(data) >= HEADER.size + 16:
            magic, version, kind, session, counter = HEADER.unpack_from(data)
            kind = kind if (magic, version) == (b"KNDM", VERSION) else -1
        payload, key = data[HEADER.size : -16], self.session_key
        ours = session == self.session and bool(self.senders)
        if kind == HELLO:
            key, ours = self.key, len(payload) == 16
        elif kind == OPEN and session == int.from_bytes(self.nonce[:8], "little"):
            key = blake2s(b"kendama session" + payload + self.nonce, key=self.key, digest_size=32).digest()
            ours = not self._held()
        believed = kind in (HELLO, OPEN, RESET, COMMAND, HALT) and ours
        if not believed or not hmac.compare_digest(tag(key, data[:-16]), data[-16:]):
            self.ignored += 1
            return Heard.NOTHING
        if kind == HELLO:
            self._send(self.key, (CHALLENGE, self.session if self._held() else 0, 0), payload + self.nonce, sender)
        elif kind == OPEN and session != self.session:
            self.session_key, self.session, self.senders, self.nonce = key, session, [sender], secrets.token_bytes(16)
            self.reason, self.moving, self.ready, self.missed = None, False, False, 0
            self.counter, self.heard_s, self.last = counter, time.monotonic(), OPEN
            self._welcome()
        elif counter == self.counter:
            self.senders = [*[one for one in self.senders if one != sender][1 - MOST_SENDERS :], sender]
            if self.answered:
                self.line.sendto(self.answered, sender)
            elif self.last == RESET:
                self._send(self.session_key, (WORKING, session, counter), b"", sender)
        elif counter > self.counter:
            self.missed += counter - self.counter - 1
            self.counter, self.heard_s, self.answered, self.last = counter, time.monotonic(), b"", kind
            self.senders = [sender]  # who hears a datagram and sends it on sooner must not be answered alone
            return self._obey(kind, payload)
        else:
            self.ignored += 1
        return Heard.NOTHING

    def _obey(self, kind: int, payload: bytes) -> Heard:
        n, was, skip = len(self.about.joint_names), self.reason, 8 if kind == RESET else 0
        count = {RESET: n, COMMAND: 4 * n}.get(kind, 0)
        values = struct.unpack_from(f"<{count}d", payload, skip) if count and len(payload) == skip + 8 * count else ()
        sane = bool(values) and all(map(math.isfinite, values))
        if self.reason is not None or not sane or (kind == COMMAND and not self.ready):
            wrong = (
                "COMMAND came before RESET was answered" if sane else "a command came that is not finite or not whole"
            )
            self.stop("the commander sent HALT" if kind == HALT else wrong)
            return Heard.STOP if was is None else Heard.NOTHING
        self.ready = self.moving = kind == COMMAND
        self.command = Command(*(values[i : i + n] for i in range(0, count, n)))
        return Heard.RESET if kind == RESET else Heard.COMMAND

    def _welcome(self) -> None:
        about, n = self.about, len(self.about.joint_names)
        head = struct.pack("<BBddd", n, about.realtime, about.period_s, about.watchdog_s, 0.0)
        names = b"".join(name.encode().ljust(48, b"\0") for name in about.joint_names)
        self._say(WELCOME, head + names + b"".join(struct.pack(f"<{n}d", *row) for row in about.limits))

    def _held(self) -> bool:
        return self.reason is None and (self.moving or time.monotonic() - self.heard_s < LET_GO_S)

    def _say(self, kind: int, payload: bytes) -> None:
        for sender in self.senders:
            self.answered = self._send(self.session_key, (kind, self.session, self.counter), payload, sender)

    def _send(self, key: bytes, order: tuple[int, int, int], payload: bytes, to: tuple[str, int]) -> bytes:
        bare = HEADER.pack(b"KNDM", VERSION, *order) + payload
        self.line.sendto(data := bare + tag(key, bare), to)
        return data
