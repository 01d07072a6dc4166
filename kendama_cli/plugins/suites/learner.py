"""The laws of the learner's interface, for every variant: a table's, the baseline's, or another project's own.

Each check takes settings, with the learner that ``learn.learner`` chooses, and raises AssertionError, with the law in
words, where the learner breaks it. ``CHECKS`` lists them all. No simulator is needed: the readings are those of a ball
on a circle, and the outcomes of the rollouts are sampled.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.random import Generator

from kendama_cli.artifacts.policy import NamedArray, PolicyArtifact, policy_digest
from kendama_cli.learning.interface import Actor, Learner
from kendama_cli.learning.learners import begin_learner, make_policy, maker, resume_learner
from kendama_cli.learning.reward import Outcome
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.verification import verify_policy
from kendama_cli.plugins.suites.law import must

SEED = 12345
ROLLOUTS = 8


def check_determinism(settings: LearnSettings) -> None:
    """Check that the same random numbers and readings give the same actions and the same policy."""
    one, other = (_Practice(begin_learner(settings), settings, SEED) for _ in range(2))
    for _ in range(ROLLOUTS):
        must(one.rollout() == other.rollout(), "the same seed and readings give the same actions")
    must(one.learner.policy.digest == other.learner.policy.digest, "and the same policy")


def check_actions(settings: LearnSettings) -> None:
    """Check that accelerations are finite and within the maximum action, for any readings."""
    practice = _Practice(begin_learner(settings), settings, SEED)
    lowest, highest = settings.actions_m_s2[0], settings.actions_m_s2[-1]
    for _ in range(ROLLOUTS):
        for action in practice.rollout():
            must(math.isfinite(action), f"an action is a finite number (is {action})")
            must(lowest <= action <= highest, f"an action lies within {lowest} and {highest} m/s^2 (is {action})")


def check_holding(settings: LearnSettings) -> None:
    """Check that the action stays the same before ``next_look_s``, for any readings."""
    practice = _Practice(begin_learner(settings), settings, SEED)
    for _ in range(ROLLOUTS):
        practice.rollout()
    practice.learner.begin_rollout(practice.rng)
    first = practice.learner.act(practice.reading(0), 0.0)
    if practice.learner.next_look_s > 0.0:
        early_s = 0.5 * practice.learner.next_look_s
        again = practice.learner.act(SwingState(0.1, -1.0, 2.0, -4.0), early_s)
        must(again == first, "before next_look_s the action stays what it is")


def check_count(settings: LearnSettings) -> None:
    """Check that every rollout is counted once, by the counting rule, and reported with its result."""
    practice = _Practice(begin_learner(settings), settings, SEED)
    count = practice.learner.count
    must(count.rollouts == 0, "before the first rollout none is counted")
    for number in range(1, ROLLOUTS + 1):
        practice.rollout()
        finished = practice.finished
        must(finished is not None and finished.index == number, "rollouts are numbered from 1")
        assert finished is not None
        must(finished.success == (practice.outcome == "goal"), "a rollout that reached the goal is a success")
        must(math.isfinite(finished.reward), "its reward is finite")
        count = count.after(explored=finished.explored, success=finished.success, settings=settings.count)
        must(practice.learner.count == count, "the count is that of the counting rule")


def check_checkpoint(settings: LearnSettings) -> None:
    """Check that a learner that resumes from its saved state acts like one that was never interrupted."""
    whole = _Practice(begin_learner(settings), settings, SEED)
    for _ in range(ROLLOUTS):
        whole.rollout()
    saved = _through_a_file(whole.learner.state())
    resumed = _Practice(resume_learner(settings, saved), settings, 0)
    resumed.rng.bit_generator.state = whole.rng.bit_generator.state
    resumed.number = whole.number
    must(resumed.learner.count == whole.learner.count, "the count is saved")
    must(resumed.learner.policy.digest == whole.learner.policy.digest, "the policy is saved bit for bit")
    for _ in range(ROLLOUTS):
        must(resumed.rollout() == whole.rollout(), "resumed, it acts as if it had not been interrupted")
    must(resumed.learner.policy.digest == whole.learner.policy.digest, "resumed, it learns the same bit for bit")


def check_freezing(settings: LearnSettings) -> None:
    """Check that a frozen learner acts like its policy and learns nothing, and that a failure ends that."""
    practice = _frozen(settings)
    for _ in range(2):
        before = practice.learner.policy
        policy = make_policy(before, settings)
        policy.begin_rollout()
        actions = practice.rollout("goal")
        must(practice.finished is not None and not practice.finished.explored, "frozen, it does not explore")
        must(actions == _Practice.acted(policy, practice), "frozen, it acts as its policy does")
        must(practice.learner.policy.digest == before.digest, "frozen, nothing is learned")
    practice.rollout("timeout")
    must(not practice.learner.count.frozen(settings.count), "a failure ends the freezing")


def check_policy(settings: LearnSettings) -> None:
    """Check that a policy is sealed, passes its own verification, forgets the last rollout, and can start a learner."""
    practice = _frozen(settings)
    sealed = _stored(practice.learner.policy)
    must(sealed.kind == settings.learner.kind, "a policy names the learner whose it is")
    json.loads(sealed.meaning)
    verify_policy(sealed, settings, "the conformance suite")
    policy = make_policy(sealed, settings)
    runs = []
    for _ in range(2):
        policy.begin_rollout()
        runs.append(_Practice.acted(policy, practice))
    must(runs[0] == runs[1], "the same readings give the same actions in every rollout of a policy")
    again = begin_learner(settings, sealed)
    must(again.count.rollouts == 0, "a learner that begins from a policy has had no rollout")
    must(again.policy.digest == sealed.digest, "before its first rollout its policy is the one that it begins from")


def check_meaning(settings: LearnSettings) -> None:
    """Check that the settings that give a policy its meaning do not depend on how it was learned."""
    meaning = json.dumps(maker(settings).meaning(settings), sort_keys=True)
    again = json.dumps(maker(settings).meaning(settings), sort_keys=True)
    must(meaning == again, "the meaning of a policy follows from the settings alone")
    must(bool(json.loads(meaning)), "some settings must match wherever a policy is acted by")


CHECKS: tuple[Callable[[LearnSettings], None], ...] = (
    check_determinism,
    check_actions,
    check_holding,
    check_count,
    check_checkpoint,
    check_freezing,
    check_policy,
    check_meaning,
)


def subject(configuration: Mapping[str, Any]) -> LearnSettings:
    """Return the settings of the node ``learn``, which choose the learner."""
    settings: LearnSettings = configuration["learn"]
    return settings


def test_the_learner_keeps_the_law(law: Callable[[LearnSettings], None], configuration: Mapping[str, Any]) -> None:
    """Run by kendama_cli/conformance.py for every law."""
    law(subject(configuration))


class _Practice:
    """Rollouts with readings that are a function of their number, and outcomes that are sampled."""

    def __init__(self, learner: Learner, settings: LearnSettings, seed: int) -> None:
        self.learner, self.settings = learner, settings
        self.rng: Generator = np.random.default_rng(seed)
        self.number = 0
        self.finished: Any = None
        self.outcome: Outcome = "timeout"

    def reading(self, step: int) -> SwingState:
        """Return the state of a ball on a circle, wider from rollout to rollout, and of the cup moving to and fro
        beneath it.
        """
        phase = 0.11 * step + 0.7 * self.number
        angle = (0.5 + 0.3 * (self.number % 7)) * math.sin(phase)
        return SwingState(0.3 * math.cos(0.6 * phase), 0.9 * math.sin(phase), angle, 5.0 * math.cos(phase))

    def rollout(self, outcome: Outcome | None = None) -> list[float]:
        """Run one rollout; return the actions at every reading."""
        learner = self.learner
        learner.begin_rollout(self.rng)
        self.number += 1
        actions = self.acted(learner, self)
        self.outcome = outcome or ("goal" if self.rng.random() < 0.5 else "timeout")
        self.finished = learner.end_rollout(self.outcome, self.reading(self.steps))
        return actions

    @property
    def steps(self) -> int:
        """Readings of a rollout, 10 ms apart."""
        return min(150, round(self.settings.rollout_s / 0.01))

    @staticmethod
    def acted(actor: Actor, practice: _Practice) -> list[float]:
        """Return the actions of ``actor`` at the readings of the present rollout."""
        return [float(actor.act(practice.reading(step), 0.01 * step)) for step in range(practice.steps)]


def _frozen(settings: LearnSettings) -> _Practice:
    """Return a learner whose streak has frozen it."""
    practice = _Practice(begin_learner(settings), settings, SEED)
    for _ in range(20 * settings.count.learned_streak):
        if practice.learner.count.frozen(settings.count):
            return practice
        practice.rollout("goal")
    raise AssertionError(f"broken law: a learner that always succeeds is frozen after {settings.count.learned_streak}")


def _through_a_file(state: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``state`` as a checkpoint restores it: arrays, and JSON values."""
    arrays = {name: np.array(value) for name, value in state.items() if isinstance(value, np.ndarray)}
    plain = {name: value for name, value in state.items() if not isinstance(value, np.ndarray)}
    return {**json.loads(json.dumps(plain)), **arrays}


def _stored(policy: PolicyArtifact) -> PolicyArtifact:
    """Return ``policy`` as a store restores it."""
    arrays = tuple(NamedArray(entry.name, np.array(entry.values)) for entry in policy.arrays)
    must(policy_digest(policy.kind, policy.meaning, arrays) == policy.digest, "a policy is sealed over all it holds")
    return PolicyArtifact(policy.kind, policy.meaning, arrays, policy.digest)
