"""The forces of a step beside the equation that they are to fulfil, and distances beside bounded least squares."""

import math

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from kendama_cli.simulation.dart import step_kernel
from kendama_cli.simulation.dart.dynamics_kernel import carry_rotors
from kendama_cli.simulation.dart.torque_kernel import FINE, LOST, NEAR

N = 5


def _distance(point, start, end):
    """The distance from a point to a segment as a bounded least-squares problem."""
    found = lsq_linear((end - start)[:, None], point - start, (0.0, 1.0), method="bvls", tol=1e-14)
    return math.sqrt(2 * found.cost)


def _state(rng):
    square = rng.normal(size=(N, N))
    return {
        "position_rad": rng.uniform(-0.6, 0.6, N),
        "velocity_rad_s": rng.choice([0.0, 1e-3, 1.0], N) * rng.normal(size=N),
        "effort": 3 * rng.normal(size=N),
        "level": rng.choice([0.0, 1.0, 10.0], N) * rng.uniform(size=N),
        "ball_m": rng.normal(0, 0.2, 3),
        "ball_m_s": rng.normal(0, 1, 3),
        "reaction_n": rng.normal(0, 5, 3),
        "pivot_m": rng.normal(0, 0.5, 3),
        "touch_n": rng.normal(0, 5, 3),
        "screws": rng.normal(size=(N, 6)),
        "inertia": square @ square.T + 5 * np.eye(N),
        "rotor": rng.uniform(0.01, 0.05, N),
        "bias": 3 * rng.normal(size=N),
        "points": rng.normal(0, 0.5, (N + 2, 3)),
        "radii": np.append(rng.choice([-np.inf, 0.05], N + 1, p=[0.2, 0.8]), 0.1),
        "joints": rng.uniform(0.1, 2, (5, N)),
        "limits": np.outer([-1.0, 1.0, 3.0, 9.0, -0.5, 0.5], np.ones(N)) * rng.uniform(0.6, 1.5, N),
        "factor": rng.uniform(0.5, 2),
        "period": 0.01,
    }


def test_the_forces_fulfil_the_step_s_equation_with_coulomb_s_law_and_tell_what_may_touch():
    rng, answers, pressed = np.random.default_rng(1), [], []
    for _ in range(300):
        one, (force, change) = _state(rng), np.empty((2, N))
        if rng.random() < 0.4:
            one["points"][-1] = one["ball_m"] + rng.normal(0, 0.08, 3)
        answers.append(step_kernel.joint_forces(*one.values(), force, change))
        margin = 0.02 + 0.002 * np.abs(one["ball_m_s"]).sum()
        by_cup = np.linalg.norm(one["ball_m"] - one["points"][N + 1]) < 0.1 + margin
        pressed.append(by_cup)

        def of_joints(force_n, at_m, one=one):
            return one["screws"] @ np.concatenate([np.cross(at_m, force_n), force_n])

        pull, v, period = of_joints(one["reaction_n"], one["pivot_m"]), one["velocity_rad_s"], one["period"]
        load = one["effort"] + pull + by_cup * of_joints(one["touch_n"], one["ball_m"]) - one["bias"]
        viscous, carried = one["factor"] * one["joints"][3], np.zeros(N)
        friction = (one["inertia"] + period * np.diag(viscous)) @ change - load + viscous * v
        carry_rotors(one["screws"], v, change, one["rotor"], carried)
        if answers[-1] == NEAR:  # else DART needs none
            assert force == pytest.approx(one["effort"] + pull + friction + carried)
        after = v + period * change
        moving = np.abs(after) > 1e-9
        assert (np.abs(friction) <= one["level"] + 1e-9).all()
        assert friction[moving] == pytest.approx((-one["level"] * np.sign(after))[moving], abs=1e-9)
        q, points, radii = one["position_rad"], one["points"], one["radii"]
        near = (q <= one["limits"][0] + 0.02) | (q >= one["limits"][1] - 0.02) | (np.abs(v) > 0.9 * one["limits"][2])
        gaps = [_distance(one["ball_m"], *points[i : i + 2]) - radii[i] for i in range(N + 1) if radii[i] >= 0]
        assert answers[-1] == (NEAR if near.any() or by_cup or min(gaps, default=1.0) < margin else FINE)
    assert set(answers) == {FINE, NEAR}
    assert 20 < sum(pressed) < 280
    one["inertia"] = -one["inertia"]
    assert step_kernel.joint_forces(*one.values(), force, change) == LOST


def test_the_distance_to_a_segment_or_a_point_is_the_least_over_its_points():
    rng = np.random.default_rng(2)
    for scale in (0.05, 1.0):
        for _ in range(40):
            point, start, end = rng.normal(0, [[1.0], [1.0], [scale]], (3, 3))
            assert step_kernel._distance(point, start, start + end) == pytest.approx(
                _distance(point, start, start + end), abs=1e-7
            )
            assert step_kernel._distance(point, start, start) == pytest.approx(np.linalg.norm(point - start))
