"""A policy from a file: the ``artifact.json`` of a PolicyArtifact or TransferResult, ``arrays.npz`` beside it."""

from __future__ import annotations

import json
from pathlib import Path

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.artifacts.transfer_result import TransferResult
from kendama_cli.errors import InputError
from kendama_cli.schema.artifacts import from_plain
from kendama_cli.schema.unpacking import unpacked_arrays


def load_policy(path: str) -> PolicyArtifact:
    """The policy whose structure is in ``path``; raises InputError where it is none (its seal is checked elsewhere)."""
    remedy = "give the artifact.json that `kendama run --json` names for the stage learn or transfer"
    try:
        body = json.loads(Path(path).read_bytes())
        arrays = unpacked_arrays(Path(path).with_name("arrays.npz").read_bytes())
        found: PolicyArtifact | TransferResult = from_plain(PolicyArtifact | TransferResult, body, arrays)
        return found.policy if isinstance(found, TransferResult) else found
    except Exception as error:  # many kinds, for what is no document, no archive or no policy
        problem = f"holds no policy ({type(error).__name__}: {' '.join(str(error).split())})"
        raise InputError(path, problem, remedy=remedy) from None
