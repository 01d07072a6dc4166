"""Verification of a policy before anything moves: it is intact and fits its use."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from kendama_cli.artifacts.policy import PolicyArtifact, policy_digest
from kendama_cli.artifacts.transfer_result import TransferResult
from kendama_cli.errors import InputError, StageError
from kendama_cli.learning.learners import maker
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.schema.artifacts import from_plain
from kendama_cli.schema.json_text import json_text
from kendama_cli.schema.unpacking import unpacked_arrays


def verify_policy(policy: PolicyArtifact, settings: LearnSettings, source: str) -> None:
    """Raise StageError, in one line that says what differs, unless ``policy`` may be acted by under ``settings``.

    Checked are the digest over all that it holds, the learner, the meaning that this learner's policies have under
    ``settings``, and the arrays; that their values are finite is checked by the artifact itself.
    """
    found = policy_digest(policy.kind, policy.meaning, policy.arrays)
    if found != policy.digest:
        raise StageError(
            f"the policy of {source} is damaged: its digest is {found[:12]}, its seal says {policy.digest[:12]}; "
            "nothing was moved, learn it again"
        )
    configured = json_text(maker(settings).meaning(settings))
    task, desired = (_task(meaning) for meaning in (policy.meaning, configured))
    if (policy.kind, task) != (settings.learner.kind, desired):
        raise StageError(
            f"the policy of {source} is one of task '{task}', learned by '{policy.kind}'; the configuration has task "
            f"'{settings.task}' and learner '{settings.learner.kind}'; nothing was moved, configure 'learn' as it was, "
            "or learn again"
        )
    if policy.meaning != configured:
        differences = "; ".join(_differences(_parsed(policy.meaning), json.loads(configured), "learn"))
        raise StageError(
            f"the policy of {source} was learned with another configuration ({differences}); nothing was moved, "
            "configure 'learn' as it was, or learn again"
        )
    try:
        maker(settings).policy(policy, settings)
    except ValueError as error:
        raise StageError(f"the policy of {source} cannot be acted by: {error}; nothing was moved") from error


def _task(meaning: str) -> str:
    """Return the task that a policy's meaning names, as far as it names one."""
    parsed = _parsed(meaning)
    return str(parsed.get("task", "unknown")) if isinstance(parsed, dict) else "unknown"


def _parsed(meaning: str) -> Any:
    try:
        return json.loads(meaning)
    except ValueError:
        return meaning


def _differences(have: Any, want: Any, key: str) -> Iterator[str]:
    if isinstance(have, dict) and isinstance(want, dict):
        for name in sorted({*have, *want}):
            if have.get(name) != want.get(name):
                yield from _differences(have.get(name), want.get(name), f"{key}.{name}")
    else:
        yield f"{key} is {json.dumps(want)}, it was {json.dumps(have)}"


def load_policy(path: str) -> PolicyArtifact:
    """Load the policy whose structure is in ``path``; raises InputError if it is none (its seal is checked
    elsewhere).
    """
    remedy = "give the artifact.json that `kendama run --json` names for the stage learn or transfer"
    try:
        body = json.loads(Path(path).read_bytes())
        packed = Path(path).with_name("arrays.npz")
        arrays = unpacked_arrays(packed.read_bytes()) if packed.is_file() else {}
        found: PolicyArtifact | TransferResult = from_plain(PolicyArtifact | TransferResult, body, arrays)
        policy = found.policy if isinstance(found, TransferResult) else found
        if policy is None:
            raise ValueError("the transfer had none")
        return policy
    except Exception as error:  # many kinds, for what is no document, no archive or no policy
        problem = f"holds no policy ({type(error).__name__}: {' '.join(str(error).split())})"
        raise InputError(path, problem, remedy=remedy) from None
