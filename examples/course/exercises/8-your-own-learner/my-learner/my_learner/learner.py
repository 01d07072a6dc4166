"""Searches a swing, a cos-wave of the cup's acceleration, by trying; replays the best that was caught."""

import dataclasses
import math

import numpy as np

from kendama_cli.extension import (
    FinishedRollout,
    HeldAction,
    LearnerMaker,
    LearningCount,
    PolicyArtifact,
    StateGrid,
    final_reward,
    task_meaning,
)
from my_learner.search import propose

REST = (0.0, 5.0)


class Wave:
    """The action nearest to A sin(w t), at the times at which actions may change; a Policy."""

    table = None
    decides_on_bins = True  # so compiled code asks only then

    def __init__(self, swing, settings):
        self._share, self._pace = swing
        self._settings, self._grid = settings, StateGrid(settings.grid)
        self.begin_rollout()

    def begin_rollout(self):
        self._held, self.decisions = HeldAction(self._settings, self._grid), 0

    @property
    def next_look_s(self):
        return self._held.next_look_s

    def act(self, state, t_s):
        held, actions = self._held, np.array(self._settings.actions_m_s2)
        if t_s >= held.next_look_s:
            row = held.due(state, t_s)
            if row is not None:
                wanted = self._share * actions[-1] * math.sin(self._pace * t_s)
                held.hold(row, int(np.argmin(np.abs(actions - wanted))), t_s)
                self.decisions += 1
        return float(actions[held.action])


class Search:
    """Explores until a swing was caught; replays that one, and explores on after a failure of it."""

    table = None
    decides_on_bins = True

    def __init__(self, settings, policy=None):
        self._settings = settings
        self._kept = REST if policy is None else swing_of(policy)
        self._best, self._best_streak = self._kept, 0
        self._remembered = []
        self.count = LearningCount(succeeded_ever=policy is not None)

    @classmethod
    def resume(cls, settings, state):
        learner = cls(settings)
        learner._kept, learner._best = tuple(state["kept"]), tuple(state["best"])
        learner._best_streak = state["best_streak"]
        learner._remembered = [(reward, tuple(swing)) for reward, swing in state["remembered"]]
        learner.count = LearningCount(**state["count"])
        return learner

    def state(self):
        return {
            "kept": list(self._kept),
            "best": list(self._best),
            "best_streak": self._best_streak,
            "remembered": [[reward, list(swing)] for reward, swing in self._remembered],
            "count": dataclasses.asdict(self.count),
        }

    @property
    def policy(self):
        swing = self._best if self._best_streak > self.count.streak else self._kept
        return PolicyArtifact.seal("mine", meaning(self._settings), {"swing": np.array(swing)})

    @property
    def next_look_s(self):
        return self._wave.next_look_s

    def begin_rollout(self, rng):
        self._explored = not self.count.succeeded_ever or self.count.greedy_failed
        own = self._settings.learner
        tried = propose(rng, list(self._remembered), own) if self._explored else self._kept
        self._tried = (float(np.clip(tried[0], -1.0, 1.0)), float(tried[1]))
        self._wave = Wave(self._tried, self._settings)

    def act(self, state, t_s):
        return self._wave.act(state, t_s)

    def end_rollout(self, outcome, state, miss_m=None):
        success = outcome == "goal"
        reward = final_reward(self._settings.reward, outcome, miss_m)
        if self._explored:
            if success:
                self._kept = self._tried
            # of equally good ones the newest first
            ranked = sorted([(reward, self._tried), *self._remembered], key=lambda one: -one[0])
            self._remembered = ranked[: self._settings.learner.remembered]
        self.count = self.count.after(explored=self._explored, success=success, settings=self._settings.count)
        if self.count.streak > self._best_streak:
            self._best, self._best_streak = self._kept, self.count.streak
        return FinishedRollout(self.count.rollouts, self._explored, success, reward, self._wave.decisions)


def swing_of(policy):
    swing = policy.array("swing")
    if swing.shape != (2,):
        raise ValueError(f"the swing has shape {swing.shape}; allowed: (2,), share and frequency")
    return float(swing[0]), float(swing[1])


def meaning(settings):
    """Return the settings that must match wherever the swing is played: the task, its actions, and their times."""
    return task_meaning(settings)


def act_by(policy, settings):
    return Wave(swing_of(policy), settings)


LEARNER = LearnerMaker(begin=Search, resume=Search.resume, policy=act_by, meaning=meaning)
