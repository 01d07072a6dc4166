"""Learners and policies of the kind that ``learn.learner`` chooses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.interface import Learner, LearnerMaker, Policy
from kendama_cli.learning.registry import LEARNERS
from kendama_cli.learning.settings import LearnSettings


def begin_learner(settings: LearnSettings, policy: PolicyArtifact | None = None) -> Learner:
    """A learner before its first rollout, from nothing or from ``policy``, which has been verified."""
    return maker(settings).begin(settings, policy)


def resume_learner(settings: LearnSettings, state: Mapping[str, Any]) -> Learner:
    """The learner whose ``state()`` is ``state``, between the same two rollouts."""
    return maker(settings).resume(settings, state)


def make_policy(artifact: PolicyArtifact, settings: LearnSettings) -> Policy:
    """What acts by ``artifact``, which has been verified (``learning/verification.py``)."""
    return maker(settings).policy(artifact, settings)


def parted_state(state: Mapping[str, Any], name: str) -> dict[str, Any]:
    """A learner's state with its arrays at the top, as a checkpoint takes them: ``NAME/q`` beside ``NAME``."""
    arrays = {f"{name}/{key}": value for key, value in state.items() if isinstance(value, np.ndarray)}
    return {**arrays, name: {key: value for key, value in state.items() if not isinstance(value, np.ndarray)}}


def joined_state(state: Mapping[str, Any], name: str) -> dict[str, Any]:
    """The learner's state that ``parted_state`` parted, from all that a checkpoint holds."""
    arrays = {key.removeprefix(f"{name}/"): value for key, value in state.items() if key.startswith(f"{name}/")}
    return {**state[name], **arrays}


def maker(settings: LearnSettings) -> LearnerMaker:
    """What makes the learners of the kind that ``settings`` choose."""
    made: LearnerMaker = LEARNERS.maker(settings.learner.kind)
    return made
