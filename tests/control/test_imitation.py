"""A planned motion stretched to the robot's periods, and where its ball came down beside the cup."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.control.imitation import SETTLE_S, Played, _from_rest, stretched
from tests.control.observed_games import GAME


def test_a_motion_is_read_at_the_end_of_every_period_slower_by_tau_and_then_rests() -> None:
    """q(t / tau), q' / tau and q'' / tau^2 on straight lines between the plan's samples, whose times begin anywhere."""
    rows, period_s, tau = np.random.default_rng(10022).normal(size=(3, 90, 2)), 0.007, 1.3
    motion = JointTrajectory(("a", "b"), 0.5 + 0.01 * np.arange(90), *rows)
    made = stretched(motion, tau, period_s)
    assert made.t_s == pytest.approx(period_s * np.arange(1, round((0.89 * tau + SETTLE_S) / period_s) + 1))
    moving = made.t_s <= 0.89 * tau
    for order, (found, planned) in enumerate(
        zip((made.position_rad, made.velocity_rad_s, made.acceleration_rad_s2), rows, strict=True)
    ):
        for joint in range(2):
            wanted = np.interp(made.t_s / tau, 0.01 * np.arange(90), planned[:, joint]) / tau**order
            assert found[:, joint] == pytest.approx(np.where(moving | (order == 0), wanted, 0.0))
    begun = _from_rest(made, np.array([9.0, 8.0]))
    assert begun.t_s == pytest.approx([0.0, *made.t_s])
    assert begun.position_rad == pytest.approx(np.vstack([[9.0, 8.0], made.position_rad]))
    assert not begun.velocity_rad_s[0].any()
    assert not begun.acceleration_rad_s2[0].any()
    assert np.array_equal(begun.velocity_rad_s[1:], made.velocity_rad_s)


@pytest.mark.parametrize(("from_plan", "miss_m"), [(False, 0.02), (True, 0.07)])
def test_a_miss_is_told_beside_the_tracked_cup_or_beside_the_planned_one(from_plan: bool, miss_m: float) -> None:
    """A cup that goes along x and leaves its plan by 50 mm, tracked 3 mm too high; the ball falls 20 mm beside it."""
    upright = np.eye(3)
    arm: Any = SimpleNamespace(
        tool_position_m=lambda q: np.array([q[0], 0.0, 1.0]),
        tool_pose=lambda q: SimpleNamespace(position_m=np.array([q[0], 0.0, 1.0]), rotation=upright),
    )
    t_s = 0.004 * np.arange(1, 251)
    planned = np.minimum(t_s, 0.6)[:, None]
    exchanges = []
    for k, t in enumerate([0.0, *t_s]):
        x = float(planned[k - 1, 0]) + 0.05 * min(t, 0.5) / 0.5 if k else 0.0
        cup = np.array([x, 0.0, 1.003])
        ball = cup + np.array([0.02, 0.0, GAME.cup.rim_m + 0.2 - 1.2 * max(t - 0.5, 0.0)])
        state = SimpleNamespace(position_rad=np.array([x]), cup_in_world_m=cup, ball_in_world_m=ball)
        exchanges.append(SimpleNamespace(t_s=9.0 + t, state=state))
    played = Played(tuple(exchanges), JointTrajectory(("a",), t_s, planned, 0 * planned, 0 * planned))  # type: ignore[arg-type]
    assert played.miss_m(arm, GAME, from_plan=from_plan) == pytest.approx((miss_m, 0.0), abs=1e-6)
    assert played.apex_m == pytest.approx(GAME.cup.rim_m + 0.2)
