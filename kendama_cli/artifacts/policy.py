"""Policies: a Q-table with all that is needed to act by it on any machine."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from kendama_cli.schema.arrays import Array, array


@dataclass(frozen=True)
class Policy:
    """A state-action table Q (states, actions) for the swing-up.

    ``learning`` is the canonical JSON of the learning settings (state bins, actions, goal) the table was learned
    with; ``digest`` seals table and settings together, so that hardware can refuse what it was not made for.
    """

    q: Array
    learning: str
    digest: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "q", array("q", self.q, (None, None)))

    @staticmethod
    def seal(q: Array, learning: str) -> Policy:
        """A policy with its digest computed."""
        return Policy(q=q, learning=learning, digest=policy_digest(q, learning))


def policy_digest(q: Array, learning: str) -> str:
    """SHA-256 over the table's shape and little-endian bytes and the learning settings."""
    table = array("q", q, (None, None))
    seal = hashlib.sha256(repr(table.shape).encode())
    seal.update(table.astype("<f8").tobytes())
    seal.update(learning.encode())
    return seal.hexdigest()
