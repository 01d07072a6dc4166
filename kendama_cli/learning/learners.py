"""Learners and policies of the kind that ``learn.learner`` chooses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.interface import Learner, LearnerMaker, Policy
from kendama_cli.learning.settings import LEARNERS, LearnSettings


def begin_learner(settings: LearnSettings, policy: PolicyArtifact | None = None) -> Learner:
    """Return a learner before its first rollout, new or from ``policy``, which has been verified."""
    return maker(settings).begin(settings, policy)


def resume_learner(settings: LearnSettings, state: Mapping[str, Any]) -> Learner:
    """Return the learner whose ``state()`` is ``state``, between the same two rollouts."""
    return maker(settings).resume(settings, state)


def make_policy(artifact: PolicyArtifact, settings: LearnSettings) -> Policy:
    """Return the policy that acts by ``artifact``, which has been verified (``learning/verification.py``)."""
    return maker(settings).policy(artifact, settings)


def parted_state(state: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return a learner's state with its arrays at the top, as a checkpoint stores them: ``NAME/q`` beside ``NAME``."""
    arrays = {f"{name}/{key}": value for key, value in state.items() if isinstance(value, np.ndarray)}
    return {**arrays, name: {key: value for key, value in state.items() if not isinstance(value, np.ndarray)}}


def joined_state(state: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return the learner's state that ``parted_state`` split, from the content of a checkpoint."""
    arrays = {key.removeprefix(f"{name}/"): value for key, value in state.items() if key.startswith(f"{name}/")}
    return {**state[name], **arrays}


def maker(settings: LearnSettings) -> LearnerMaker:
    """Return the maker of the kind of learner that ``settings`` choose."""
    made: LearnerMaker = LEARNERS.maker(settings.learner.kind)
    return made
