"""A table is refused, in one line, where it is not what it says or not what the configuration needs."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.artifacts.policy import Policy
from kendama_cli.errors import StageError
from kendama_cli.learning.policy import learning_json
from kendama_cli.learning.verification import verify_policy
from tests.learning.settings_files import learn_settings

SETTINGS = learn_settings()
GOOD = Policy.seal(np.zeros((324, 5)), learning_json(SETTINGS))


def test_a_table_learned_as_configured_is_accepted():
    verify_policy(GOOD, SETTINGS, "run 1")


@pytest.mark.parametrize(
    ("policy", "message"),
    [
        (
            Policy.seal(np.zeros((162, 5)), GOOD.learning),
            "has 162 states x 5 actions; the configuration 'learn' needs 324",
        ),
        (dataclasses.replace(GOOD, q=np.ones((324, 5))), "is damaged: its digest is"),
        (
            Policy.seal(np.zeros((324, 5)), learning_json(learn_settings("terminate"))),
            'another configuration (learn.grid.position is "distance", it was "mirrored")',
        ),
    ],
    ids=["shape", "digest", "workspace"],
)
def test_another_table_is_refused_with_what_differs(policy, message):
    with pytest.raises(StageError) as told:
        verify_policy(policy, SETTINGS, "run 1")
    assert message in str(told.value)
    assert "\n" not in str(told.value)
