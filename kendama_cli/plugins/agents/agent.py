"""Agents of other libraries by the manner that is common to them, and what of an agent is kept.

An entry point of ``kendama.agents`` names ``make(environment, seed)``, which returns an agent: an object with
``predict(observation)``, or a function of an observation. One that learns has ``learn(steps)`` and keeps what it has
learned in ``state_dict()`` and ``load_state_dict(...)``, its own or those of its ``policy``, as networks of PyTorch do.
Only these arrays are kept, never a file of the agent's, which might hold code.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.errors import StageError
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.plugins.agents.settings import AGENTS, AgentSettings
from kendama_cli.plugins.agents.training import AgentEnvironment
from kendama_cli.schema.arrays import Array

_STORED = 4
"""This many loaded policies are kept for the next rollout, as a network may take a second to make."""


def own_settings(learn: LearnSettings) -> AgentSettings:
    """Return the settings of the agent among those of ``learn``."""
    assert isinstance(learn.learner, AgentSettings)
    return learn.learner


class Agent:
    """An agent and the environment that it was made for."""

    def __init__(self, learn: LearnSettings, seed: int, arrays: Mapping[str, Array] | None = None) -> None:
        """Make it, and load ``arrays``; raises StageError where it cannot be made, ValueError where they do not fit."""
        self.name = own_settings(learn).agent.kind
        self.environment = AgentEnvironment(learn, own_settings(learn))
        self._rollout_s = learn.rollout_s
        make = AGENTS.maker(self.name)
        self.itself = self.tried(lambda: make(self.environment, seed))
        self._predict: Callable[..., Any] = getattr(self.itself, "predict", self.itself)
        if not callable(self._predict):
            raise StageError(f"agent '{self.name}' is {self.itself!r}; it needs 'predict', or must be a function")
        parameters = inspect.signature(self._predict).parameters
        self._options = {"deterministic": True} if "deterministic" in parameters else {}
        if arrays:
            self._load(arrays)

    def tried(self, call: Callable[[], Any]) -> Any:
        """Return what ``call`` returns; raises StageError, in one line, where the agent fails."""
        try:
            return call()
        except Exception as error:  # an agent may fail in any way
            told = " ".join(f"{type(error).__name__}: {error}".split())
            raise StageError(f"agent '{self.name}' failed ({told}); the log has where") from error

    def observation(self, state: SwingState, t_s: float) -> Array:
        """Return what the agent observes of ``state`` at ``t_s`` into the rollout."""
        return np.asarray(self.environment.observed.reading(state, self._rollout_s - t_s), dtype=np.float64)

    def acceleration(self, state: SwingState, t_s: float) -> float:
        """Return the cup's acceleration that the agent predicts, without exploring [m/s^2]."""
        observation = self.observation(state, t_s).astype(np.float32)
        found = self.tried(lambda: self._predict(observation, **self._options))
        action = found[0] if isinstance(found, tuple) else found
        try:
            return self.environment.accelerations.one(action)
        except gymnasium.error.InvalidAction as error:
            raise StageError(f"agent '{self.name}': {error}") from None

    @property
    def arrays(self) -> dict[str, Array]:
        """Return a copy of what the agent has learned; empty for one that has no ``learn``.

        Raises StageError where it learns and does not tell what.
        """
        if not hasattr(self.itself, "learn"):
            return {}
        learned = self._stateful().state_dict()
        return {str(name): np.array(_plain(values), dtype=np.float64) for name, values in sorted(learned.items())}

    def _stateful(self) -> Any:
        found = next((one for one in (self.itself, getattr(self.itself, "policy", None)) if _has_state(one)), None)
        if found is None:
            raise StageError(
                f"agent '{self.name}' has 'learn' and nothing that says what it learned; give it, or its 'policy', "
                "state_dict() and load_state_dict(), arrays by name"
            )
        return found

    def _load(self, arrays: Mapping[str, Array]) -> None:
        there = self._stateful().state_dict()
        if sorted(there) != sorted(arrays):
            raise ValueError(f"agent '{self.name}' holds {', '.join(sorted(there))}; the policy {', '.join(arrays)}")
        for name, values in arrays.items():
            if np.shape(_plain(there[name])) != values.shape:
                raise ValueError(f"its '{name}' has shape {values.shape}; the agent needs {np.shape(there[name])}")
        self._stateful().load_state_dict({name: _like(there[name], values) for name, values in arrays.items()})


def _has_state(one: Any) -> bool:
    return hasattr(one, "state_dict") and hasattr(one, "load_state_dict")


def _plain(values: Any) -> Any:
    """Return ``values`` as an array; a tensor of PyTorch is copied from wherever it is."""
    return values.detach().cpu().numpy() if hasattr(values, "detach") else np.asarray(values)


def _like(there: Any, values: Array) -> Any:
    """Return ``values`` of the type of ``there``: an array, or a tensor of PyTorch."""
    plain = values.astype(_plain(there).dtype)
    return there.new_tensor(plain) if hasattr(there, "new_tensor") else plain


_loaded: dict[tuple[str, LearnSettings], Agent] = {}


def frozen_agent(artifact: PolicyArtifact, learn: LearnSettings) -> Agent:
    """Return the agent of ``artifact``, made once; raises ValueError where its arrays do not fit."""
    key = artifact.digest, learn
    if key not in _loaded:
        while len(_loaded) >= _STORED:
            del _loaded[next(iter(_loaded))]
        _loaded[key] = Agent(learn, 0, {entry.name: entry.values for entry in artifact.arrays})
    return _loaded[key]
