"""A policy is refused, in one line, where it is not what it says or not what the configuration needs."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.artifacts.policy import NamedArray, PolicyArtifact
from kendama_cli.errors import StageError
from kendama_cli.learning.decision import seal_table, task_meaning
from kendama_cli.learning.verification import verify_policy
from tests.learning.settings_files import learn_settings

SETTINGS = learn_settings()
GOOD = seal_table(np.zeros((324, 5)), SETTINGS)
SEARCH = learn_settings("easy", "learn/learner=random_replay")


def test_a_table_learned_as_configured_is_accepted():
    verify_policy(GOOD, SETTINGS, "run 1")


@pytest.mark.parametrize(
    ("policy", "message"),
    [
        (
            seal_table(np.zeros((162, 5)), SETTINGS),
            "cannot be acted by: the table has shape (162, 5); the configuration 'learn' needs (324, 5)",
        ),
        (
            PolicyArtifact.seal("sarsa", task_meaning(SETTINGS), {"values": np.zeros((324, 5))}),
            "cannot be acted by: the policy has no array 'q'; it has values",
        ),
        (dataclasses.replace(GOOD, arrays=(NamedArray("q", np.ones((324, 5))),)), "is damaged: its digest is"),
        (dataclasses.replace(GOOD, kind="random_replay"), "is damaged: its digest is"),
        (
            seal_table(np.zeros((324, 5)), learn_settings("paper_caught")),
            "is one of task 'paper_caught', learned by 'sarsa'; the configuration has task 'easy' and learner 'sarsa'",
        ),
        (
            PolicyArtifact.seal("mine", {}, {}),
            "is one of task 'unknown', learned by 'mine'; the configuration has task 'easy' and learner 'sarsa'",
        ),
    ],
    ids=["shape", "array", "digest", "kind", "workspace", "learner"],
)
def test_another_policy_is_refused_with_what_differs(policy, message):
    with pytest.raises(StageError) as refused:
        verify_policy(policy, SETTINGS, "run 1")
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_harmonic_is_refused_where_it_would_drive_something_else():
    meaning = {**task_meaning(SEARCH), "drives_place": False, "bang_bang": False}
    good = PolicyArtifact.seal("random_replay", meaning, {"harmonic": np.array([5.0, 6.0, 1.0])})
    verify_policy(good, SEARCH, "run 1")
    other = PolicyArtifact.seal("random_replay", {**meaning, "drives_place": True}, {"harmonic": np.ones(3)})
    with pytest.raises(StageError, match=r"another configuration \(learn.drives_place is false, it was true\)"):
        verify_policy(other, SEARCH, "run 1")
    short = PolicyArtifact.seal("random_replay", meaning, {"harmonic": np.ones(2)})
    with pytest.raises(StageError, match=r"cannot be acted by: the harmonic has shape \(2,\); allowed: \(3,\)"):
        verify_policy(short, SEARCH, "run 1")


def test_two_arrays_of_one_name_are_refused():
    with pytest.raises(ValueError, match="arrays of a policy must have names of their own, not q, q"):
        PolicyArtifact("table", "{}", (NamedArray("q", np.ones(1)), NamedArray("q", np.zeros(1))), "")
