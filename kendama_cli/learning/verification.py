"""Whether a Q-table is what it says and fits what it is to be used for: asked before anything moves."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from kendama_cli.artifacts.policy import Policy, policy_digest
from kendama_cli.errors import StageError
from kendama_cli.learning.discretisation import StateGrid
from kendama_cli.learning.policy import learning_json
from kendama_cli.learning.settings import LearnSettings


def verify_policy(policy: Policy, settings: LearnSettings, source: str) -> None:
    """Raise StageError, in one line that says what differs, unless ``policy`` may be acted by under ``settings``.

    Checked are the digest over table and settings, the shape, and that bins, actions, decisions and goal are those
    configured; that the values are finite is checked by the artifact itself.
    """
    found = policy_digest(policy.q, policy.learning)
    if found != policy.digest:
        raise StageError(
            f"the Q-table of {source} is damaged: its digest is {found[:12]}, its seal says {policy.digest[:12]}; "
            "nothing was moved, learn it again"
        )
    wanted = (StateGrid(settings.grid).n_states, len(settings.actions_m_s2))
    if policy.q.shape != wanted:
        raise StageError(
            f"the Q-table of {source} has {policy.q.shape[0]} states x {policy.q.shape[1]} actions; the configuration "
            f"'learn' needs {wanted[0]} x {wanted[1]}; nothing was moved"
        )
    configured = learning_json(settings)
    if policy.learning != configured:
        differences = "; ".join(_differences(_parsed(policy.learning), json.loads(configured), "learn"))
        raise StageError(
            f"the Q-table of {source} was learned with another configuration ({differences}); nothing was moved, "
            "configure 'learn' as it was, or learn again"
        )


def _parsed(learning: str) -> Any:
    try:
        return json.loads(learning)
    except ValueError:
        return learning


def _differences(have: Any, want: Any, key: str) -> Iterator[str]:
    if isinstance(have, dict) and isinstance(want, dict):
        for name in sorted({*have, *want}):
            if have.get(name) != want.get(name):
                yield from _differences(have.get(name), want.get(name), f"{key}.{name}")
    else:
        yield f"{key} is {json.dumps(want)}, it was {json.dumps(have)}"
