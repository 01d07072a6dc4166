"""A session between one commander and a robot: whose datagrams are obeyed, and in which order."""

from __future__ import annotations

from kendama_cli.devices.robot.datagram_line import Address
from kendama_cli.devices.robot.protocol import Datagram


class Session:
    """The open session, or in ``stopped`` the reason why none is open.

    With ``may_skip`` a lost datagram is counted in ``missed``, as in real time; without it, it ends the session.
    """

    def __init__(self, *, may_skip: bool) -> None:
        self.stopped: str | None = "no session has begun"
        self.peer: Address | None = None
        self.number = self.sequence = self.missed = 0
        self.ready = False
        self._may_skip = may_skip
        self._numbers: set[int] = set()

    @property
    def is_first(self) -> bool:
        """Whether no session has begun yet."""
        return not self._numbers

    def refused(self, hello: Datagram, sender: Address) -> str | None:
        """Why ``hello`` begins no session; None where it does."""
        known = hello.session in self._numbers
        if self.stopped is not None and not known:
            return None
        what = "a repeated HELLO" if known else "the HELLO of another session"
        return f"{what} came from {sender[0]}:{sender[1]} while a session was open"

    def begin(self, hello: Datagram, sender: Address) -> None:
        """Open the session of ``hello``; commands are obeyed from its first RESET on (``ready``)."""
        self._numbers.add(hello.session)
        self.number, self.peer, self.sequence = hello.session, sender, hello.sequence
        self.ready, self.missed, self.stopped = False, 0, None

    def disorder(self, datagram: Datagram, sender: Address) -> str | None:
        """What is wrong with the sender, session or place in the sequence of ``datagram``; None where nothing is."""
        ahead, kind = datagram.sequence - self.sequence, datagram.kind.name
        if sender != self.peer:
            return f"a foreign {kind} came from {sender[0]}:{sender[1]}"
        if datagram.session != self.number:
            return f"a {kind} of another session came"
        if ahead <= 0:
            return f"{kind} {datagram.sequence} came late or again; {self.sequence + 1} was due"
        if ahead > 1 and not self._may_skip:
            return f"{kind} {datagram.sequence} came where {self.sequence + 1} was due: a datagram is lost"
        return None

    def take(self, datagram: Datagram) -> None:
        """Go on to the place of ``datagram`` in the sequence, counting those before it that are missing."""
        self.missed += datagram.sequence - self.sequence - 1
        self.sequence = datagram.sequence
