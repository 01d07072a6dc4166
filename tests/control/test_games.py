"""Swing-ups and games on a robot without DART: the same mechanism that plays on the arm."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.control.catch_controller import make_catch_geometry
from kendama_cli.control.catch_game import find_crossing
from kendama_cli.control.flight_observer import MarkerObserver
from kendama_cli.control.game_runner import GameRunner
from kendama_cli.control.position_tracker import PositionTracker
from kendama_cli.control.settings import TransferSettings
from kendama_cli.devices.robot.udp.remote import UdpRobot
from kendama_cli.learning.decision import GreedyPolicy
from kendama_cli.learning.sarsa import SarsaLearner
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.settings.game import GameSettings
from kendama_cli.stages.learn.stage import Learn
from kendama_cli.vision.settings import PredictSettings
from tests.control.cart_robot import DIRECTION, MIDDLE_M, CartRobot, Straight
from tests.learning.settings_files import learn_settings
from tests.memory_context import MemoryContext
from tests.shipped_conf import configured

GAME: GameSettings = configured(GameSettings, "game", "kendama")
LEARN: LearnSettings = learn_settings()
TRANSFER: TransferSettings = configured(TransferSettings, "transfer", "default")
PREDICT: PredictSettings = configured(PredictSettings, "predict", "flights")


def make_runner(
    believed_scale: float = 1.0, learn: LearnSettings = LEARN, settings: TransferSettings = TRANSFER, **made: Any
) -> GameRunner:
    """Games observed through the marker of a robot without an arm; its rope is measured elsewhere."""
    robot = CartRobot(GAME, **made)
    geometry = make_catch_geometry(
        MIDDLE_M, DIRECTION, GAME, settings.catch, rope_scale=believed_scale, period_s=robot.period_s
    )
    rim_m, catch_m = geometry.rim_height_m, geometry.catch_height_m
    sigma_m = [TRANSFER.observation.position_sigma_m] * 3
    tracker = PositionTracker(PREDICT.onset, PREDICT.motion, GAME, rim_height_m=rim_m, sigma_m=sigma_m)
    return GameRunner(
        cast(UdpRobot, robot),
        Straight(),
        geometry=geometry,
        observer=MarkerObserver(tracker, TRANSFER.observation, rim_m=rim_m, catch_m=catch_m),
        game=GAME,
        learn=learn,
        settings=settings,
    )


def learned(runner: GameRunner, seed: int, cap: int = 400) -> SarsaLearner:
    learner, rng = SarsaLearner(LEARN), np.random.default_rng(seed)
    while not learner.count.learned and learner.count.rollouts < cap:
        learner.begin_rollout(rng)
        swing = runner.swing_up(learner, seed=int(rng.integers(2**63)))
        learner.end_rollout(swing.outcome, swing.last)
    return learner


@pytest.fixture(scope="module")
def solved() -> list[PolicyArtifact]:
    """Policies of ``easy``, solved by 80 catches in a row on the rail, as the stage hands them over."""
    made = [Learn(learn=LEARN, game=GAME).run({}, MemoryContext(seed=seed)) for seed in range(4)]
    assert all(one.metrics["solved"] for one in made)
    return [one.artifact for one in made]


@pytest.fixture(scope="module")
def policy(solved: list[PolicyArtifact]) -> PolicyArtifact:
    return solved[0]


@pytest.mark.slow
def test_the_swing_up_is_learned_through_observations_alone() -> None:
    assert learned(make_runner(noise_m=0.0005, delay_n=4, rope_scale=1.05), 4).count.learned


def test_the_cup_stays_inside_while_it_swings(policy: PolicyArtifact) -> None:
    for seed in range(5):
        swing = make_runner(noise_m=0.0005).swing_up(GreedyPolicy(policy, LEARN), seed=seed)
        assert swing.peak_displacement_m <= LEARN.workspace.half_width_m + 0.003, "noise of the marker is on top"


@pytest.mark.parametrize(("scale", "half_width_m"), [(0.9, 0.36), (1.0, 0.4), (1.04, 0.416), (1.3, 0.42)])
def test_the_workspace_is_similar_to_the_models_as_far_as_the_catch_may_use_it(
    scale: float, half_width_m: float
) -> None:
    class Outward:
        def act(self, state: SwingState, t_s: float) -> float:
            return 8.0

    swing = make_runner(scale, rope_scale=scale).swing_up(Outward(), seed=0)
    assert swing.peak_displacement_m == pytest.approx(half_width_m, abs=1e-3)


@pytest.mark.parametrize(
    ("rope_scale", "delay_n", "late_n"),
    [
        pytest.param(1.0, 0, 0, marks=pytest.mark.slow),
        (1.05, 6, 0),
        pytest.param(0.95, 3, 0, marks=pytest.mark.slow),
        pytest.param(1.0, 3, 8, marks=pytest.mark.slow),
    ],
)
def test_games_are_caught_in_spite_of_rope_delay_and_noise(
    solved: list[PolicyArtifact], rope_scale: float, delay_n: int, late_n: int
) -> None:
    """The rope's length is believed as games measure it. Ten policies, four games each on every body: 120 of 120.

    Tables that only reached the goal ten times in a row are not caught so: 60 of 80, 73 of 80 and 67 of 79.
    """
    runner = make_runner(rope_scale, noise_m=0.0005, rope_scale=rope_scale, delay_n=delay_n, tracking_late_n=late_n)
    played = [runner.play(GreedyPolicy(policy, LEARN), seed=number) for policy in solved for number in range(4)]
    assert sum(game.caught for game in played) >= 15
    errors = [game.prediction_error_m(0.1) for game in played]
    assert np.median([error for error in errors if error is not None]) < 0.004


def test_a_game_is_the_same_for_the_same_seed(policy: PolicyArtifact) -> None:
    games = [make_runner(noise_m=0.0005).play(GreedyPolicy(policy, LEARN), seed=7) for _ in range(2)]
    assert str(games[0]) == str(games[1])


def test_the_arms_delay_is_estimated_from_the_rollout_itself(policy: PolicyArtifact) -> None:
    runner = make_runner(noise_m=0.0005, delay_n=5)
    runner.swing_up(GreedyPolicy(policy, LEARN), seed=1)
    assert runner._cart.delay_s == pytest.approx(0.020, abs=0.002)
    assert runner._cart.arm_lag_s == pytest.approx(0.020, abs=0.002)


def test_the_crossing_is_the_first_fall_through_the_height() -> None:
    path = np.array([[float(k), 0.1 * k, 0.0, z] for k, z in enumerate([0.0, 1.0, 2.0, 1.0, 0.0, 1.0])])
    found = find_crossing(path, 0.5, 0.0)
    assert found is not None
    assert found.t_s == pytest.approx(3.5)
    assert found.position_m == pytest.approx([0.35, 0.0, 0.5])
    assert find_crossing(path[:3], 0.5, 0.0) is None
    assert find_crossing(path, 0.5, 4.0) is None, "what was before free flight does not count"


def test_the_crossing_of_a_noisy_flight_is_known_better_than_one_reading() -> None:
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 0.4, 0.004)
    flight = np.column_stack([t, 0.1 + 0.5 * t, -0.02 * t, 1.0 + 1.2 * t - 4.905 * t**2])
    late = (1.2 + np.sqrt(1.44 + 4 * 4.905 * 0.05)) / 9.81
    wanted = [0.1 + 0.5 * late, -0.02 * late, 0.95]
    misses = []
    for _ in range(200):
        noisy = flight + np.column_stack([np.zeros(len(t)), rng.normal(0.0, 0.002, (len(t), 3))])
        found = find_crossing(noisy, 0.95, 0.0)
        assert found is not None
        misses.append(np.linalg.norm(found.position_m[:2] - wanted[:2]))
    assert np.sqrt(np.mean(np.square(misses))) < 0.002, "measured 1.0 mm; a single reading is 2.8 mm off"
