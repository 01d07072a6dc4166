from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.adaptation.catch_family import shifted_plan
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.motion.dmp.primitive import play
from tests.motion.swings import demonstration, settings

FLIGHT = (0.55, 0.75)
SHIFT_M = (0.1, -0.04)


@pytest.fixture(scope="module")
def plan() -> MotionPlan:
    return encode_demonstrations([demonstration()], settings())


def _moved(plan: MotionPlan, share: np.ndarray) -> np.ndarray:
    t_s = share * plan.duration_s
    return np.asarray(play(shifted_plan(plan, SHIFT_M, FLIGHT), t_s).position_m - play(plan, t_s).position_m)


def test_the_motion_before_the_flight_stays_and_after_it_runs_beside_itself(plan: MotionPlan) -> None:
    """Twenty functions follow a step of a fifth of the motion within some percent of it."""
    before = _moved(plan, np.linspace(0.0, FLIGHT[0] - 0.05, 100))
    after = _moved(plan, np.linspace(FLIGHT[1] + 0.02, 1.0, 100))
    assert np.abs(before).max() < 0.03 * SHIFT_M[0]
    assert np.abs(after - [*SHIFT_M, 0.0]).max() < 0.06 * SHIFT_M[0]


def test_it_settles_exactly_at_the_goal_so_moved(plan: MotionPlan) -> None:
    assert _moved(plan, np.array([3.0]))[0] == pytest.approx([*SHIFT_M, 0.0], abs=1e-6)
    assert shifted_plan(plan, SHIFT_M, FLIGHT).goal_m - plan.goal_m == pytest.approx([*SHIFT_M, 0.0])


def test_no_shift_changes_nothing(plan: MotionPlan) -> None:
    same = shifted_plan(plan, (0.0, 0.0), FLIGHT)
    assert np.array_equal(same.weights, plan.weights)
    assert np.array_equal(same.goal_m, plan.goal_m)
