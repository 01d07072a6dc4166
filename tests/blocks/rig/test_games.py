"""Swing-ups and games on a robot without DART: the same mechanism that plays on the arm."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import yaml

from kendama_cli.artifacts.policy import Policy
from kendama_cli.blocks.rig.catch_game import crossing_m
from kendama_cli.blocks.rig.imitation import tempos
from kendama_cli.blocks.rig.playground import Playground
from kendama_cli.blocks.robot.remote import UdpRobot
from kendama_cli.learning.policy import GreedyPolicy
from kendama_cli.learning.sarsa import SarsaLearner
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.learn import LearnSettings
from kendama_cli.settings.schema import build
from kendama_cli.settings.transfer import TransferSettings
from tests.blocks.rig.cart_robot import DIRECTION, MIDDLE_M, CartRobot, Straight
from tests.learning.settings_files import learn_settings

CONF = Path(__file__).resolve().parents[3] / "conf"


def configured(schema: Any, group: str, name: str) -> Any:
    return build(schema, yaml.safe_load((CONF / group / f"{name}.yaml").read_text()), group)


GAME: GameSettings = configured(GameSettings, "game", "kendama")
LEARN: LearnSettings = learn_settings()
TRANSFER: TransferSettings = configured(TransferSettings, "transfer", "default")


def ground(**robot: Any) -> Playground:
    return Playground(
        cast(UdpRobot, CartRobot(GAME, **robot)),
        Straight(),
        middle_m=MIDDLE_M,
        direction=DIRECTION,
        game=GAME,
        learn=LEARN,
        settings=TRANSFER,
    )


def learned(place: Playground, seed: int, cap: int = 400) -> SarsaLearner:
    learner, rng = SarsaLearner(LEARN), np.random.default_rng(seed)
    while not learner.count.learned and learner.rollouts < cap:
        learner.begin_rollout(rng)
        swing = place.swing_up(learner, seed=int(rng.integers(2**63)))
        learner.end_rollout(swing.outcome, swing.last)
    return learner


@pytest.fixture(scope="module")
def policy() -> Policy:
    return learned(ground(noise_m=0.0005), 0).policy


def test_the_swing_up_is_learned_through_observations_alone() -> None:
    assert learned(ground(noise_m=0.0005, delay_n=4, rope_scale=1.05), 4).count.learned


def test_the_cup_stays_inside_while_it_swings(policy: Policy) -> None:
    for seed in range(5):
        swing = ground(noise_m=0.0005).swing_up(GreedyPolicy(policy, LEARN), seed=seed)
        assert swing.peak_displacement_m <= LEARN.workspace.half_width_m + 0.003, "noise of the marker is on top"


@pytest.mark.parametrize(("rope_scale", "delay_n"), [(1.0, 0), (1.05, 6), (0.95, 3)])
def test_games_are_caught_in_spite_of_rope_delay_and_noise(rope_scale: float, delay_n: int) -> None:
    """Four tables learned on that body, four games each; a table may have learned a goal that is hard to catch."""
    place = ground(noise_m=0.0005, rope_scale=rope_scale, delay_n=delay_n)
    games = []
    for seed in range(4):
        table = learned(place, seed).policy
        games += [place.play(GreedyPolicy(table, LEARN), seed=number) for number in range(4)]
    played = [game for game in games if game.swung_up]
    assert len(played) >= 12
    assert sum(game.caught for game in played) >= 0.6 * len(played)
    errors = [game.prediction_error_m(0.1) for game in played]
    assert np.median([error for error in errors if error is not None]) < 0.004


def test_a_game_is_the_same_for_the_same_seed(policy: Policy) -> None:
    games = [ground(noise_m=0.0005).play(GreedyPolicy(policy, LEARN), seed=7) for _ in range(2)]
    assert str(games[0]) == str(games[1])


def test_the_arms_delay_is_told_by_the_rollout_itself(policy: Policy) -> None:
    place = ground(noise_m=0.0005, delay_n=5)
    place.swing_up(GreedyPolicy(policy, LEARN), seed=1)
    assert place._cart.lag_s == pytest.approx(0.020, abs=0.002)


def test_the_crossing_is_the_first_fall_through_the_height() -> None:
    path = [np.array([0.1 * k, 0.0, z]) for k, z in enumerate([0.0, 1.0, 2.0, 1.0, 0.0, 1.0])]
    crossing = crossing_m(path, 0.5)
    assert crossing is not None
    assert crossing == pytest.approx([0.35, 0.0, 0.5])
    assert crossing_m(path[:3], 0.5) is None


def test_tempos_go_outward_from_the_planned_one() -> None:
    assert tempos(0.01, 5) == pytest.approx((1.0, 1.01, 0.99, 1.02, 0.98))
