"""Report of a transfer: rollouts until a table handed over is solved on the hardware."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.learning.learners import begin_learner
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import Imperfection
from kendama_cli.stages.transfer.progress import Progress
from tests.control.cart_robot import CartRobot
from tests.control.quick_twin import QuickTwin
from tests.control.test_games import TRANSFER
from tests.learning.settings_files import learn_settings
from tests.shipped_conf import plain

LEARN = learn_settings("hard")
GAME = build(GameSettings, plain("game", "kendama"), "game")


@pytest.mark.parametrize(("misses", "wins", "proof"), [(0, 80, 0), (3, 80, 3), (3, 79, 200)])
def test_the_rollouts_before_eighty_in_a_row_are_reported(misses: int, wins: int, proof: int) -> None:
    settings = dataclasses.replace(TRANSFER, solved_streak=80, max_rollouts=200)
    progress = Progress.resumed(None, begin_learner(LEARN).policy, LEARN, settings, np.random.default_rng(0))
    learner = progress.learner()
    for success in [False] * misses + [True] * wins:
        learner.count = learner.count.after(explored=False, success=success, settings=LEARN.count)  # type: ignore[attr-defined]
    progress.keep(learner)
    assert progress.rollouts_to_solved() == proof
    assert progress.solved() is (wins == 80)
    assert progress.frozen("table") is (wins == 80)


def test_learning_that_ends_at_ten_in_a_row_reports_no_proof() -> None:
    settings = dataclasses.replace(TRANSFER, solved_streak=10)
    progress = Progress.resumed(None, begin_learner(LEARN).policy, LEARN, settings, np.random.default_rng(0))
    assert progress.solved() is None


@pytest.mark.parametrize(
    ("wins", "before", "after", "back"), [(10, 6, 3, True), (10, 3, 6, False), (10, 5, 5, False), (80, 6, 5, False)]
)
def test_what_learning_made_worse_is_not_stored_unless_it_is_proven(
    wins: int, before: int, after: int, back: bool
) -> None:
    settings = dataclasses.replace(TRANSFER, solved_streak=80, max_rollouts=200)
    handed = begin_learner(LEARN).policy
    progress = Progress.resumed(None, handed, LEARN, settings, np.random.default_rng(0))
    learner = progress.learner()
    for _ in range(wins):
        learner.count = learner.count.after(explored=False, success=True, settings=LEARN.count)  # type: ignore[attr-defined]
    progress.keep(learner)
    progress.before += [True] * before + [False] * (8 - before)
    progress.after += [True] * after + [False] * (8 - after)
    assert progress.reverted() is back
    assert (progress.kept(handed) is handed) is back


def test_a_quick_twin_without_errors_swings_as_the_robot_that_was_there_before() -> None:
    """Two integrations of one law, with 1 and 0.5 ms: 2 mm apart after a second."""
    values = dict.fromkeys((field.name for field in dataclasses.fields(Imperfection)), 0.0)
    values |= dict.fromkeys(("rope_scale", "mass_scale", "drag_scale", "drift_s"), 1.0)
    made = Imperfection(**values)
    quick, plainly = QuickTwin(GAME, made), CartRobot(GAME)
    quick.reset(np.zeros(1), 0)
    plainly.reset(np.zeros(1), 0)
    plainly.ball[0] = 0.0
    apart, x, v = [], 0.0, 0.0
    for k in range(250):
        a = 3.0 * np.cos(5.0 * 0.004 * k)
        x, v = x + 0.004 * v + 0.5 * 0.004**2 * a, v + 0.004 * a

        command = JointCommand(np.array([x]), np.array([v]), np.array([a]))
        places = [robot.exchange(command).state.ball_in_world_m for robot in (quick, plainly)]
        apart.append(float(np.linalg.norm(places[0] - places[1])))
    assert max(apart) < 0.004
