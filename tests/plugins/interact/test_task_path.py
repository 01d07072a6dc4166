"""The script's reference: smooth, and where it was asked to be."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.motion.rotation import exp_of, log_of
from kendama_cli.plugins.interact.settings import StepSettings
from kendama_cli.plugins.interact.task_path import TaskPath

START_M = np.array([0.1, -0.2, 1.2])
START = exp_of([0.3, -0.5, 0.2])
STEPS = (
    StepSettings("go", 1.0, (0.3, 0.0, 1.0), (0.0, 0.4, 0.0), (0.0, 0.0, 0.0)),
    StepSettings("press", 0.5, (0.3, 0.0, 1.0), (0.0, 0.4, 0.0), (0.0, 3.0, -4.0)),
    StepSettings("wipe", 0.8, (0.0, 0.0, 1.0), (0.5, 0.1, 0.0), (0.0, 3.0, -4.0)),
    StepSettings("leave", 0.7, (0.0, 0.0, 1.3), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
)
PATH = TaskPath(STEPS, START_M, START)


def test_every_step_ends_at_rest_at_its_pose_with_its_force():
    assert PATH.duration_s == pytest.approx(3.0)
    first = PATH.at(0.0)
    assert first.position_m == pytest.approx(START_M)
    assert first.rotation == pytest.approx(START)
    for end_s, step in zip((1.0, 1.5, 2.3, 3.0), STEPS, strict=True):
        reference = PATH.at(end_s - 1e-12)
        assert reference.position_m == pytest.approx(step.position_m)
        assert reference.rotation == pytest.approx(exp_of(step.rotation_rad) @ START)
        assert reference.force_n == pytest.approx(step.force_n, abs=1e-9)
        assert np.abs(reference.velocity).max() < 1e-6
    late = PATH.at(9.0)
    assert late.position_m == pytest.approx(STEPS[-1].position_m)
    assert not late.velocity.any()
    assert not late.acceleration.any()


def test_velocity_and_acceleration_are_the_derivatives_of_the_pose():
    h = 1e-5
    for t in np.arange(0.01, 3.0, 0.037):
        before, now, after = (PATH.at(t + k * h) for k in (-1, 0, 1))
        moved = (after.position_m - before.position_m) / (2 * h)
        turned = log_of(after.rotation @ before.rotation.T) / (2 * h)
        assert now.velocity == pytest.approx([*moved, *turned], abs=1e-6)
        assert now.acceleration == pytest.approx((after.velocity - before.velocity) / (2 * h), abs=1e-5)


def test_nothing_jumps_from_step_to_step():
    for end_s in (1.0, 1.5, 2.3):
        before, after = PATH.at(end_s - 1e-9), PATH.at(end_s + 1e-9)
        for name in ("position_m", "rotation", "velocity", "acceleration", "force_n"):
            assert getattr(before, name) == pytest.approx(getattr(after, name), abs=1e-5), name
        assert before.force_share == pytest.approx(after.force_share, abs=1e-6)


def test_the_springs_give_way_along_the_force_as_it_comes_and_return_as_it_goes():
    along = np.array([0.0, 0.6, -0.8])
    for t, share in ((0.5, 0.0), (1.25, 0.5), (1.9, 1.0), (2.65, 0.5), (3.0, 0.0)):
        reference = PATH.at(t)
        assert reference.force_share == pytest.approx(share)
        assert reference.force_n == pytest.approx(5.0 * share * along)
        if share:
            assert reference.force_axis == pytest.approx(along)


def test_a_step_is_settled_where_a_force_stays_what_it_is():
    assert [PATH.settled(i) for i in range(4)] == [False, False, True, False]
    assert [PATH.step_at(t) for t in (0.0, 0.99, 1.2, 2.0, 2.9, 7.0)] == [0, 0, 1, 2, 3, 3]
