"""A session between one commander and a robot: who is believed, whose datagrams are obeyed, and in which order."""

from __future__ import annotations

import time
from enum import Enum

from kendama_cli.devices.robot.udp.liveness import Address, has_socket
from kendama_cli.devices.robot.udp.protocol import Datagram, Kind
from kendama_cli.devices.robot.udp.seal import (
    NONCE_BYTES,
    ForeignDatagramError,
    Seal,
    fresh_nonce,
    read_header,
    session_number,
    session_seal,
)

COMMANDS = (Kind.RESET, Kind.COMMAND, Kind.TORQUE, Kind.HALT)
LET_GO_S = 60.0
"""A commander on another machine that was silent for so long, its robot at rest, has let go when another one asks."""
_SENDERS = 4
"""So many are answered at once, at most."""
_LOOK_S = 0.5
"""How often it is looked, at most, whether the commander still lives."""


class Place(Enum):
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

    def place(self, datagram: Datagram, sender: Address) -> Place:
        """Return the place of ``datagram``; the next one is taken, and those missing before it are counted."""
        ahead = datagram.counter - self.counter
        if ahead < 0:
            self.ignored += 1
            return Place.OLD
        if ahead == 0:
            if sender not in self.senders:
                self.senders = [*self.senders[-_SENDERS + 1 :], sender]
            return Place.REPEATED
        if ahead > 1 and not self._may_skip:
            return Place.SKIPPING
        self.missed += ahead - 1
        self.counter, self.heard_s, self.senders = datagram.counter, time.monotonic(), [sender]
        return Place.NEXT

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
