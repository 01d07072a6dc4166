"""Release of the swing on a robot: its own cup's reach counts, not that of the weaker cup of learning."""

from __future__ import annotations

import dataclasses
from typing import cast

import pytest

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.control.catch_controller import goal_here
from kendama_cli.control.game_runner import GameRunner
from kendama_cli.control.settings import TransferSettings
from kendama_cli.learning.learners import make_policy
from kendama_cli.stages.learn.stage import Learn
from tests.control.cart_robot import CartRobot
from tests.control.test_games import GAME, TRANSFER, make_runner
from tests.learning.settings_files import learn_settings
from tests.memory_context import MemoryContext

LEARN = learn_settings("hard", count__evaluation_rollouts=1)
GAMES = 5


@pytest.fixture(scope="module")
def policy() -> PolicyArtifact:
    """A table whose release is beyond the learner's cup in four times the air's force, as of every table tried."""
    artifact: PolicyArtifact = Learn(learn=LEARN, game=GAME).run({}, MemoryContext(10002)).artifact
    return artifact


def in_thick_air(settings: TransferSettings) -> GameRunner:
    """On a rope of known 5 % more, in an air of which nothing is known."""
    runner = make_runner(believed_scale=1.05, learn=LEARN, settings=settings, rope_scale=1.05, noise_m=0.0005)
    robot = cast(CartRobot, runner.robot)
    robot.drag_per_m *= 4.0
    return runner


def test_what_the_robots_cup_reaches_is_let_go_and_caught(policy: PolicyArtifact) -> None:
    runner = in_thick_air(TRANSFER)
    games = [runner.play(make_policy(policy, LEARN), seed=seed) for seed in range(GAMES)]
    assert sum(game.caught for game in games) >= GAMES - 1


def test_a_cup_as_weak_as_the_learners_lets_nothing_of_that_go(policy: PolicyArtifact) -> None:
    weak = dataclasses.replace(TRANSFER.catch, acceleration_m_s2=LEARN.goal.catch_acceleration_m_s2)
    runner = in_thick_air(dataclasses.replace(TRANSFER, catch=weak))
    ended = [runner.swing_up(make_policy(policy, LEARN), seed=seed).outcome for seed in range(GAMES)]
    assert ended.count("goal") <= 1


def test_half_of_the_cups_acceleration_counts_and_never_less_than_the_learners() -> None:
    catch = dataclasses.replace(TRANSFER.catch, acceleration_m_s2=14.0)
    assert goal_here(LEARN.goal, catch).catch_acceleration_m_s2 == 7.0
    assert goal_here(LEARN.goal, dataclasses.replace(catch, acceleration_m_s2=1.0)) == LEARN.goal
