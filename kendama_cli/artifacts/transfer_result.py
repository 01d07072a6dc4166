"""Transfers: what the hardware made of the policy and the primitive."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.artifacts.policy import PolicyArtifact


@dataclass(frozen=True)
class TransferResult:
    """The policy after learning on the hardware, or as handed over where that made it worse; what was counted there."""

    policy: PolicyArtifact
    rollouts: int
    imitation_caught: bool | None
    """None where no imitation motion was handed over."""
    games: int
    caught: int
