"""Training of an agent that drives its environment itself, in rollouts that others drive.

The agent's ``learn`` runs in a thread of its own. It is told what happened and is asked for the next action; of the two
threads one always waits, so that the same events lead to the same agent.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any, Literal

import gymnasium
import numpy as np
from numpy.typing import NDArray

from kendama_cli.learning.settings import LearnSettings
from kendama_cli.plugins.agents.environments.spaces import Accelerations, Observation, Observed
from kendama_cli.plugins.agents.settings import AgentSettings

BEGAN, HELD, TERMINATED, TRUNCATED = range(4)
Event = NDArray[np.float64]
"""BEGAN, HELD, TERMINATED or TRUNCATED, the reward of the last action, and the observation: (7,)."""
_Answer = tuple[Literal["action", "waits", "over", "failed"], Any]


class _Closed(BaseException):
    """Nobody plays on: the agent's ``learn`` is left here."""


class AgentEnvironment(gymnasium.Env[Observation, Any]):
    """The swing-up as the training of an agent sees it: observations, actions and rewards of ``kendama/SwingUp-v1``.

    ``seed`` and ``options`` of ``reset`` have no effect, as the rollouts are the product's. A reset before the end of
    a rollout begins an episode in the middle of it.
    """

    def __init__(self, learn: LearnSettings, own: AgentSettings) -> None:
        self.observed = Observed.swing(learn, normalised=own.normalised)
        self.accelerations = Accelerations(learn, own.actions)
        self.observation_space, self.action_space = self.observed.box, self.accelerations.space
        self._events: SimpleQueue[Event | None] = SimpleQueue()
        self._answers: SimpleQueue[_Answer] = SimpleQueue()
        self._now: Observation | None = None

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Observation, dict[str, Any]]:
        """Wait for the next rollout; return its first observation."""
        super().reset(seed=seed)
        if self._now is None:
            self._answers.put(("waits", None))
            self._now = self._event()[2:].astype(np.float32)
        return self._now, {}

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Hold ``action``; raises gymnasium's ResetNeeded after an end, InvalidAction for none."""
        if self._now is None:
            raise gymnasium.error.ResetNeeded("call reset() first: no rollout is under way")
        self._answers.put(("action", self.accelerations.one(action)))
        event = self._event()
        kind, observation = int(event[0]), event[2:].astype(np.float32)
        self._now = observation if kind == HELD else None
        return observation, float(event[1]), kind == TERMINATED, kind == TRUNCATED, {}

    def _event(self) -> Event:
        event = self._events.get()
        if event is None:
            raise _Closed
        return event

    def train(self, learn: Callable[[int], Any], steps: int) -> None:
        """Call ``learn(steps)``, in the agent's thread."""
        try:
            learn(steps)
        except _Closed:
            return
        except Exception as error:  # an agent may fail in any way
            self._answers.put(("failed", error))
        else:
            self._answers.put(("over", None))

    def tell(self, event: Event | None) -> None:
        """Report an event to the agent's thread; None ends it."""
        self._events.put(event)

    def answer(self) -> _Answer:
        """Return what the agent's thread says next."""
        return self._answers.get()


class Training:
    """The training of ``agent`` in ``environment``, one event after another."""

    def __init__(self, agent: Any, environment: AgentEnvironment, learn: LearnSettings, own: AgentSettings) -> None:
        """Begin it; where the agent has no ``learn``, it is over at once. Raises what the agent raises."""
        self.over = not hasattr(agent, "learn")
        self._environment = environment
        if self.over:
            return
        rollouts = max(1, learn.count.max_rollouts - own.validation_rollouts)
        steps = rollouts * math.ceil(learn.rollout_s / own.hold_s)
        self._thread = threading.Thread(target=environment.train, args=(agent.learn, steps), daemon=True)
        self._thread.start()
        self._answered()

    def tell(self, event: Event) -> float | None:
        """Report ``event``; return the acceleration that the agent wants then [m/s^2], None after an end or where the
        training is over. Raises what the agent raises.
        """
        if self.over:
            return None
        self._environment.tell(event)
        return self._answered()

    def _answered(self) -> float | None:
        kind, value = self._environment.answer()
        if kind in ("over", "failed"):
            self.over = True
            self._thread.join()
        if kind == "failed":
            raise value
        return value if kind == "action" else None

    def close(self) -> None:
        """End the training where it waits."""
        if not self.over:
            self.over = True
            self._environment.tell(None)
            self._thread.join()
