"""Transfers: results of policy and primitive on the hardware."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.artifacts.policy import PolicyArtifact


@dataclass(frozen=True)
class TransferResult:
    """The policy after learning on the hardware, or as it came where that made it worse; counts of the games there.

    ``policy`` is None, and the counts are 0, where the imitation was played alone.
    """

    policy: PolicyArtifact | None
    rollouts: int
    imitation_caught: bool | None
    """None without an imitation motion."""
    games: int
    caught: int
