from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.robot_model.inverse_kinematics import weighted_step

RNG = np.random.default_rng(4)
JACOBIAN = RNG.normal(size=(5, 7))
WEIGHTS = RNG.uniform(0.1, 5.0, 7)
CHANGE = RNG.normal(size=5)


def test_the_step_makes_the_wanted_change() -> None:
    assert JACOBIAN @ weighted_step(JACOBIAN, CHANGE, WEIGHTS) == pytest.approx(CHANGE, abs=1e-6)


def test_no_other_step_that_makes_the_change_weighs_less() -> None:
    step = weighted_step(JACOBIAN, CHANGE, WEIGHTS)
    _, _, rows = np.linalg.svd(JACOBIAN)
    for free in rows[5:]:  # motions that leave the task alone: W-orthogonal to the least step
        assert abs(free @ (WEIGHTS * step)) < 1e-6


def test_a_task_without_redundancy_is_just_inverted() -> None:
    square = JACOBIAN[:, :5]
    assert weighted_step(square, CHANGE, np.ones(5)) == pytest.approx(np.linalg.solve(square, CHANGE), rel=1e-4)


def test_a_jacobian_that_lost_rank_still_gives_a_finite_step() -> None:
    flat = JACOBIAN.copy()
    flat[4] = flat[3]
    assert np.isfinite(weighted_step(flat, CHANGE, WEIGHTS)).all()
