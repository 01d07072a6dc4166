"""The learner ``agent``: an agent of another library is trained in the rollouts of ``learn``, frozen and validated.

All rollouts but the last ``validation_rollouts`` of ``learn.count.max_rollouts`` train it, by its own ``learn``, or as
many as that takes. They count as exploring. Then it is frozen, and acts by ``predict``. One that begins
from a policy, as on a robot, is frozen from the start.
"""

from __future__ import annotations

import dataclasses
import weakref
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.random import Generator

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import NEVER_S, ROUNDING_S
from kendama_cli.learning.interface import FinishedRollout, LearnerMaker
from kendama_cli.learning.reward import Outcome, final_reward, step_reward
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.statistics import LearningCount
from kendama_cli.plugins.agents.agent import Agent, frozen_agent, own_settings
from kendama_cli.plugins.agents.environments.swing_up import Shaping
from kendama_cli.plugins.agents.training import BEGAN, HELD, TERMINATED, TRUNCATED, Event, Training

ARRAY = "learned:"
"""Prefix of the agent's own arrays in a checkpoint."""


class HoldingActor:
    """Actor that holds each action of an agent for ``hold_s``."""

    table = None
    decides_on_bins = False

    def __init__(self, learn: LearnSettings) -> None:
        self._hold_s = own_settings(learn).hold_s - ROUNDING_S
        self._let_go()

    def _let_go(self) -> None:
        self.next_look_s, self._acceleration, self._decided_s = NEVER_S, 0.0, 0.0
        self._decisions = 0

    def act(self, state: SwingState, t_s: float) -> float:
        """Return the cup's acceleration [m/s^2] at ``t_s`` into the rollout."""
        if t_s >= self.next_look_s:
            self._acceleration = self._decide(state, t_s)
            self._decided_s, self.next_look_s = t_s, t_s + self._hold_s
            self._decisions += 1
        return self._acceleration

    def _decide(self, state: SwingState, t_s: float) -> float:
        raise NotImplementedError


class AgentPolicy(HoldingActor):
    """Policy of a frozen agent."""

    def __init__(self, artifact: PolicyArtifact, learn: LearnSettings) -> None:
        """Raise ValueError where the arrays are not the agent's."""
        super().__init__(learn)
        self._agent = frozen_agent(artifact, learn)

    def begin_rollout(self) -> None:
        """Forget the last action."""
        self._let_go()

    def _decide(self, state: SwingState, t_s: float) -> float:
        return self._agent.acceleration(state, t_s)


class AgentLearner(HoldingActor):
    """Trains an agent, then validates it. See the module.

    A training that was interrupted is repeated from its events, without simulation: so it ends in the same agent
    wherever the agent's ``seed`` decides all that is random in it.
    """

    def __init__(self, learn: LearnSettings, policy: PolicyArtifact | None = None) -> None:
        """Start from nothing, or from a ``policy``, which stays as it is."""
        super().__init__(learn)
        self._learn, self._own = learn, own_settings(learn)
        self._shaping = Shaping(self._own.shaping, self._own.gamma, self._own.game)
        self.count = LearningCount(succeeded_ever=policy is not None)
        self._frozen = policy
        self._seed: int | None = None
        self._events: list[Event] = []
        self._agent: Agent | None = None
        self._training: Training | None = None
        self._explored = False
        self._validated = 0
        self._reward, self._potential = 0.0, 0.0

    @classmethod
    def from_state(cls, learn: LearnSettings, state: Mapping[str, Any]) -> AgentLearner:
        """Return the learner that ``state()`` described, between the same two rollouts."""
        arrays = {key.removeprefix(ARRAY): np.array(one) for key, one in state.items() if key.startswith(ARRAY)}
        learner = cls(learn, _sealed(arrays, learn) if state["frozen"] else None)
        learner.count = LearningCount(**state["count"])
        learner._seed, learner._validated = state["seed"], int(state["validated"])
        learner._events = list(np.array(state["events"])) if "events" in state else []
        return learner

    def state(self) -> dict[str, Any]:
        """Return the learner between two rollouts: the events of its training, or what it learned."""
        kept: dict[str, Any] = {"events": np.array(self._events)} if self._events else {}
        if self._frozen is not None:
            kept = {f"{ARRAY}{entry.name}": entry.values for entry in self._frozen.arrays}
        return {
            "count": dataclasses.asdict(self.count),
            "seed": self._seed,
            "validated": self._validated,
            "frozen": self._frozen is not None,
            **kept,
        }

    @property
    def policy(self) -> PolicyArtifact:
        """The agent as it is now, sealed."""
        if self._frozen is not None:
            return self._frozen
        agent = Agent(self._learn, 0) if self._seed is None else self._trained()[0]
        return _sealed(agent.arrays, self._learn)

    def begin_rollout(self, rng: Generator) -> None:
        """Train on, or freeze the agent and validate it; the first rollout draws the agent's seed."""
        self._let_go()
        self._reward = 0.0
        if self._frozen is None:
            if self._seed is None:
                self._seed = int(rng.integers(2**31))
            agent, training = self._trained()
            if training.over or self.count.rollouts >= self._learn.count.max_rollouts - self._own.validation_rollouts:
                training.close()
                self._frozen = _sealed(agent.arrays, self._learn)
                self._events, self._agent, self._training = [], None, None
        self._explored = self._frozen is None

    def _trained(self) -> tuple[Agent, Training]:
        """Return the agent after all events so far, and its training."""
        if self._agent is None or self._training is None:
            assert self._seed is not None
            self._agent = agent = Agent(self._learn, self._seed)
            self._training = agent.tried(lambda: Training(agent.itself, agent.environment, self._learn, self._own))
            weakref.finalize(self, self._training.close)
            for event in self._events:
                self._told(event)
        return self._agent, self._training

    def _told(self, event: Event) -> float | None:
        assert self._agent is not None
        training = self._training
        assert training is not None
        answer: float | None = self._agent.tried(lambda: training.tell(event))
        return answer

    def _decide(self, state: SwingState, t_s: float) -> float:
        reward = step_reward(self._learn.reward, state.x_m) if self._decisions else 0.0
        self._reward += reward
        if self._frozen is not None:
            return frozen_agent(self._frozen, self._learn).acceleration(state, t_s)
        agent, _ = self._trained()
        kind, potential = HELD if self._decisions else BEGAN, float(self._shaping.potential(*state[2:]))
        reward += self._shaping.reward(self._potential, potential) if self._decisions else 0.0
        self._potential = potential
        answer = self._happened(kind, reward, agent.observation(state, t_s))
        return agent.acceleration(state, t_s) if answer is None else answer

    def _happened(self, kind: int, reward: float, observation: Any) -> float | None:
        self._events.append(np.array([kind, reward, *observation]))
        return self._told(self._events[-1])

    def end_rollout(self, outcome: Outcome, state: SwingState, miss_m: float | None = None) -> FinishedRollout:
        """Report the end to the training, and count it; ``state`` is the last reading."""
        success = outcome == "goal"
        if self._decisions:
            rewards, late = self._learn.reward, outcome == "timeout"
            reward = step_reward(rewards, state.x_m) + final_reward(rewards, outcome, miss_m)
            self._reward += reward
            if self._explored:
                after = float(self._shaping.potential(*state[2:])) if late else 0.0
                reward += self._shaping.reward(self._potential, after)
                ended_s = min(self._decided_s + self._own.hold_s, self._learn.rollout_s)
                observation = self._trained()[0].observation(state, ended_s)
                self._happened(TRUNCATED if late else TERMINATED, reward, observation)
        self.count = self.count.after(explored=self._explored, success=success, settings=self._learn.count)
        self._validated += not self._explored
        if self._validated >= self._own.validation_rollouts:
            self.count = dataclasses.replace(self.count, ended=True)
        return FinishedRollout(self.count.rollouts, self._explored, success, self._reward, self._decisions)


def _sealed(arrays: Mapping[str, Any], learn: LearnSettings) -> PolicyArtifact:
    return PolicyArtifact.seal(learn.learner.kind, _meaning(learn), arrays)


def _meaning(learn: LearnSettings) -> dict[str, object]:
    """Return the settings that give an agent its meaning: the task, its observations and actions."""
    own, workspace = own_settings(learn), learn.workspace
    return {
        "task": learn.task,
        "goal": dataclasses.asdict(learn.goal),
        "actions_m_s2": learn.actions_m_s2,
        "agent": own.agent.kind,
        "actions": own.actions,
        "hold_s": own.hold_s,
        "normalised": own.normalised,
        "observed": [workspace.half_width_m, workspace.max_speed_m_s, learn.rollout_s],
    }


AGENT = LearnerMaker(begin=AgentLearner, resume=AgentLearner.from_state, policy=AgentPolicy, meaning=_meaning)
"""The kind ``agent``."""
