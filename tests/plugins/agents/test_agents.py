"""An agent of another library is trained in the product's rollouts, frozen, kept as arrays, and acts as it did."""

from __future__ import annotations

import dataclasses
import pickle
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np
import pytest

import kendama_cli.gym  # noqa: F401 - registers the environments
from kendama_cli.errors import StageError
from kendama_cli.learning.learners import begin_learner, make_policy
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.plugins.agents.settings import AGENTS
from kendama_cli.plugins.agents.training import HELD
from kendama_cli.plugins.suites import learner as conformance
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from tests.documented_package import EXAMPLES
from tests.learning.settings_files import game_settings, learn_settings

Maker = Callable[[Any, int], Any]


@pytest.fixture
def agent(monkeypatch: pytest.MonkeyPatch) -> Callable[[Maker], LearnSettings]:
    """Maker of the settings of an agent that trains for five rollouts."""

    def chosen(make: Maker, **own: Any) -> LearnSettings:
        monkeypatch.setattr(AGENTS, "maker", lambda kind: make)
        learn = learn_settings("easy", "learn/learner=agent")
        learner = dataclasses.replace(learn.learner, **{"actions": "continuous", **own})
        return dataclasses.replace(learn, learner=learner, count=dataclasses.replace(learn.count, max_rollouts=205))

    return chosen


@pytest.fixture
def linear(monkeypatch: pytest.MonkeyPatch) -> Maker:
    monkeypatch.syspath_prepend(str(EXAMPLES / "agents"))
    from lab_agents.linear import LinearAgent  # noqa: PLC0415

    made: Maker = LinearAgent
    return made


@pytest.mark.parametrize("check", conformance.CHECKS)
def test_an_agent_that_trains_keeps_every_law(check, agent, linear):
    check(agent(linear))


@pytest.mark.parametrize("check", conformance.CHECKS)
def test_a_function_keeps_every_law(check):
    check(learn_settings("easy", "learn/learner=agent"))


class Script:
    """Plays the same actions in every episode, and writes down what the environment answers."""

    def __init__(self, environment: Any, seed: int) -> None:
        self.environment = environment
        self.seen: list[Any] = []

    def learn(self, steps: int) -> None:
        for _ in range(3):
            self.seen.append(self.environment.reset()[0])
            for step in range(steps):
                *answer, _ = self.environment.step(self.action(step))
                self.seen.append(answer)
                if answer[2] or answer[3]:
                    break

    @staticmethod
    def action(step: int) -> np.ndarray:
        return np.array([np.cos(0.25 * step)])

    def predict(self, observation: Any) -> Any:
        return self.action(0)

    def state_dict(self) -> Mapping[str, Any]:
        return {}

    load_state_dict = dict.update


@pytest.mark.parametrize("shaping", [0.0, 7.0])
def test_its_training_sees_what_the_environment_of_gymnasium_shows(agent, shaping):
    scripts = []
    learn = agent(lambda *made: scripts.append(Script(*made)) or scripts[-1], shaping=shaping, gamma=0.9)
    options = {"actions": "continuous", "normalised": True, "shaping": shaping, "gamma": 0.9}
    single = gymnasium.make("kendama/SwingUp-v1", overrides=["learn/task=easy"], **options).unwrapped
    environment, learner = SwingUpEnvironment(learn, game_settings()), begin_learner(learn)
    peer = Script(single, 0)
    rng = np.random.default_rng(3)
    for seed in (3, 4, 5):
        noise = environment.noise(np.random.default_rng(seed))
        learner.begin_rollout(rng)
        rollout = environment.roll_out(learner, noise)
        learner.end_rollout(rollout.outcome, rollout.final, None if rollout.catch is None else rollout.catch.miss_m)
        peer.seen.append(single.reset(seed=seed)[0])
        over, step = False, 0
        while not over:
            *answer, _ = single.step(Script.action(step))
            over, step = answer[2] or answer[3], step + 1
            peer.seen.append(answer)
    (script,) = scripts
    assert len(script.seen) == len(peer.seen) > 100
    for mine, theirs in zip(script.seen, peer.seen, strict=True):
        if isinstance(mine, list):
            assert mine[0][:4] == pytest.approx(theirs[0][:4], abs=1e-6)  # at an end time left is that of the hold
            assert mine[1:] == [pytest.approx(theirs[1], abs=1e-5), *theirs[2:]]
        else:
            assert np.array_equal(mine, theirs)


def test_after_its_training_it_is_frozen_and_validated_in_no_more_than_the_rollouts_set_apart(agent, linear):
    learn = agent(linear, validation_rollouts=30)
    learner, rng = begin_learner(learn), np.random.default_rng(1)
    explored = []
    while not learner.count.finished(learn.count):
        learner.begin_rollout(rng)
        learner.act(SwingState(0.0, 0.0, 0.1, 0.0), 0.0)
        finished = learner.end_rollout("timeout", SwingState(0.0, 0.0, 0.1, 0.0))
        explored.append(finished.explored)
    assert explored == [True] * 175 + [False] * 30
    assert not learner.count.solved
    assert learner.count.rollouts_to_solved(learn.count) == learn.count.max_rollouts


def test_what_is_kept_is_arrays_that_act_alike_and_no_file_is_ever_asked_for(agent, linear, monkeypatch):
    learn = agent(linear)
    learner, rng = begin_learner(learn), np.random.default_rng(1)
    learner.begin_rollout(rng)
    monkeypatch.setattr(pickle, "loads", None)
    artifact = learner.policy
    assert [entry.name for entry in artifact.arrays] == ["mean"]
    policy = make_policy(artifact, learn)
    policy.begin_rollout()
    state = SwingState(0.1, -0.3, 0.8, 2.0)
    expected = np.tanh(0.0) * learn.max_action_m_s2  # its mean before any generation is 0
    assert policy.act(state, 0.0) == pytest.approx(expected)
    assert policy.act(SwingState(0.2, 0.3, -0.8, 2.0), 0.049) == policy.act(state, 0.0)


class Wrong(Script):
    def learn(self, steps: int) -> None:
        raise RuntimeError("out of\nideas")


class Untold(Script):
    state_dict = property()  # type: ignore[assignment]


def begun(learn: LearnSettings) -> None:
    learner = begin_learner(learn)
    learner.begin_rollout(np.random.default_rng(0))
    learner.act(SwingState(0.0, 0.0, 0.1, 0.0), 0.0)
    assert learner.policy


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Wrong, r"agent 'pump' failed \(RuntimeError: out of ideas\); the log has where"),
        (lambda *made: 3, "agent 'pump' is 3; it needs 'predict', or must be a function"),
        (lambda *made: lambda observation: [2.0], r"agent 'pump': action \[2.0\]; allowed: an array of one number"),
        (lambda *made: 1 / 0, r"agent 'pump' failed \(ZeroDivisionError: division by zero\)"),
        (Untold, r"has 'learn' and nothing that says what it learned; give it, or its 'policy', state_dict\(\)"),
    ],
)
def test_an_agent_that_fails_is_told_in_one_line(agent, make, message):
    with pytest.raises(StageError, match=message) as raised:
        begun(agent(make))
    assert "\n" not in str(raised.value)


def test_arrays_of_another_shape_are_refused(agent, linear):
    learn = agent(linear)
    artifact = begin_learner(learn).policy
    arrays = {"mean": np.zeros(3)}
    other = type(artifact).seal(artifact.kind, {}, arrays)
    with pytest.raises(ValueError, match=r"its 'mean' has shape \(3,\); the agent needs \(4,\)"):
        make_policy(other, learn)


def test_a_reset_in_the_middle_of_a_rollout_begins_an_episode_there(agent):
    class Restless(Script):
        def learn(self, steps: int) -> None:
            self.environment.reset()
            observation, *_ = self.environment.step(self.action(0))
            again, _ = self.environment.reset()
            assert np.array_equal(observation, again)
            self.environment.step(self.action(1))

    learn = agent(Restless)
    learner = begin_learner(learn)
    learner.begin_rollout(np.random.default_rng(0))
    for step in range(4):
        learner.act(SwingState(0.0, 0.0, 0.01 * step, 0.0), 0.05 * step)
    assert [int(event[0]) for event in learner.state()["events"]][1:] == [HELD] * 3
