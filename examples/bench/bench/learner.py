"""Random search: the cup's acceleration is linear in the state, with gains sampled until a rollout succeeds."""

import dataclasses

import numpy as np

from kendama_cli.extension import FinishedRollout, LearnerMaker, LearningCount, PolicyArtifact, final_reward


class Law:
    """Policy of the acceleration gains @ (x, velocity, angle, rate), within the actions."""

    table = None
    decides_on_bins = False  # it acts at every reading, not at changes of a bin

    def __init__(self, gains, settings):
        self._gains, self._settings = gains, settings
        self.begin_rollout()

    def begin_rollout(self):
        self.next_look_s, self._held_m_s2, self.decisions = float("-inf"), 0.0, 0

    def act(self, state, t_s):
        if t_s >= self.next_look_s:
            actions = self._settings.actions_m_s2
            self._held_m_s2 = float(np.clip(self._gains @ np.array(state), actions[0], actions[-1]))
            self.next_look_s = t_s + self._settings.decision.min_s
            self.decisions += 1
        return self._held_m_s2


class RandomSearch:
    """Learner that samples a law in every rollout until one succeeds, which then counts as greedy."""

    table = None
    decides_on_bins = False

    def __init__(self, settings, policy=None):
        self._settings = settings
        self._stored = np.zeros(4) if policy is None else gains_of(policy)
        self.count = LearningCount(succeeded_ever=policy is not None)

    @classmethod
    def resume(cls, settings, state):
        learner = cls(settings)
        learner._stored, learner.count = np.array(state["stored"]), LearningCount(**state["count"])
        return learner

    def state(self):
        return {"stored": self._stored.tolist(), "count": dataclasses.asdict(self.count)}

    @property
    def policy(self):
        return PolicyArtifact.seal("bench", meaning(self._settings), {"gains": self._stored})

    @property
    def next_look_s(self):
        return self._law.next_look_s

    def begin_rollout(self, rng):
        settings, failed = self._settings.learner, self.count.greedy_failed
        self._explored = not self.count.succeeded_ever or (failed and rng.random() < settings.resample_probability)
        self._tried = rng.standard_normal(4) * settings.spread if self._explored else self._stored
        self._law = Law(self._tried, self._settings)

    def act(self, state, t_s):
        return self._law.act(state, t_s)

    def end_rollout(self, outcome, state, miss_m=None):
        success = outcome == "goal"
        if self._explored and success:
            self._stored = self._tried
        self.count = self.count.after(explored=self._explored, success=success, settings=self._settings.count)
        reward = final_reward(self._settings.reward, outcome, miss_m)
        return FinishedRollout(self.count.rollouts, self._explored, success, reward, self._law.decisions)


def gains_of(policy):
    gains = policy.array("gains")
    if gains.shape != (4,):
        raise ValueError(f"the gains have shape {gains.shape}; allowed: (4,), one for each number of the state")
    return gains


def meaning(settings):
    """Return the meaning of a law, which must match wherever it acts: accelerations, their duration, the goal."""
    parts = {name: dataclasses.asdict(getattr(settings, name)) for name in ("decision", "goal")}
    return {**parts, "actions_m_s2": settings.actions_m_s2}


def act_by(policy, settings):
    return Law(gains_of(policy), settings)


LEARNER = LearnerMaker(begin=RandomSearch, resume=RandomSearch.resume, policy=act_by, meaning=meaning)
