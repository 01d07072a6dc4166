"""Rollouts of what learns no more: the same numbers one after the other and side by side."""

from __future__ import annotations

import dataclasses
import multiprocessing
import os
import signal

import numpy as np
import pytest

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.errors import StageError
from kendama_cli.learning.learners import make_policy
from kendama_cli.learning.sarsa import SarsaLearner
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import DartEngine
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from kendama_cli.simulation.swingup.frozen_rollouts import FrozenRollouts
from kendama_cli.system.processes import PROCESSES
from tests.learning.settings_files import learn_settings
from tests.simulation.swingup.test_arm import GAME, bench_arm

SEED = 10000
SHORT = {"rollout_s": 0.3, "count__learned_streak": 2}


def in_dart() -> LearnSettings:
    return dataclasses.replace(learn_settings("hard", **SHORT), engine=DartEngine("dart", bench_arm()))


@pytest.fixture(scope="module")
def environment() -> SwingUpEnvironment:
    return SwingUpEnvironment(in_dart(), GAME)


@pytest.fixture
def frozen_learner() -> SarsaLearner:
    """A learner with a table that acts, frozen by two successes that it was told."""
    table = np.random.default_rng(SEED).normal(size=(540, 5))
    learner = SarsaLearner(in_dart(), q=table)
    rng = np.random.default_rng(SEED)
    while not learner.count.frozen(in_dart().count):
        learner.begin_rollout(rng)
        learner.end_rollout("goal", SwingState(0.0, 0.0, 0.0, 0.0))
    return learner


@pytest.mark.parametrize("processes", ["1", "2"])
def test_a_policy_is_evaluated_as_one_rollout_after_the_other_and_a_killed_process_ends_the_stage_in_one_line(
    environment, frozen_learner, processes, monkeypatch
):
    monkeypatch.setenv(PROCESSES, processes)
    artifact, plain = frozen_learner.policy, np.random.default_rng(SEED)
    policy, expected = make_policy(artifact, in_dart()), []
    for _ in range(4):
        policy.begin_rollout()
        expected.append(environment.roll_out(policy, environment.noise(plain)))
    rng = np.random.default_rng(SEED)
    with FrozenRollouts(environment) as frozen:
        for left in range(4, 0, -1):
            assert frozen.evaluate(artifact, rng, at_most=left) == expected[4 - left]
        assert len({rollout.final for rollout in expected}) == 4
        assert rng.bit_generator.state == plain.bit_generator.state
        if processes == "2":
            frozen.evaluate(artifact, rng, at_most=200)
            for child in multiprocessing.active_children():
                os.kill(child.pid, signal.SIGKILL)
            with pytest.raises(StageError, match=f"was killed .out of memory.*{PROCESSES}=1"):
                _all_that_follow(frozen, artifact, rng)


@pytest.mark.parametrize("processes", ["1", "2"])
def test_a_learner_is_left_as_if_it_had_acted_itself(environment, frozen_learner, processes, monkeypatch):
    """A failure drops what was computed ahead, and the streams stand where they would."""
    monkeypatch.setenv(PROCESSES, processes)
    settings, state = in_dart(), frozen_learner.state()
    plain, ahead = SarsaLearner.from_state(settings, state), SarsaLearner.from_state(settings, state)
    streams = [np.random.default_rng(SEED + k) for k in range(2)]
    beside = [np.random.default_rng(SEED + k) for k in range(2)]
    with FrozenRollouts(environment) as frozen:
        for _ in range(2):  # nothing succeeds in 0.3 s: the second one is begun anew
            plain.begin_rollout(streams[0])
            rolled = environment.roll_out(plain, environment.noise(streams[1], validation=True))
            finished = plain.end_rollout(rolled.outcome, rolled.final, None)
            assert frozen.validate(ahead, *beside, at_most=5) == rolled
            assert ahead.end_rollout(rolled.outcome, rolled.final, None) == finished
            assert finished.actions > 1
    assert [rng.bit_generator.state for rng in beside] == [rng.bit_generator.state for rng in streams]
    np.testing.assert_array_equal(ahead.table, plain.table)


def _all_that_follow(frozen: FrozenRollouts, artifact: PolicyArtifact, rng: np.random.Generator) -> None:
    for left in range(199, 0, -1):
        frozen.evaluate(artifact, rng, at_most=left)
