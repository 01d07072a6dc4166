"""A primitive turned about the vertical, and the plane in which it swings."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import MotionPlan, TurnPlan
from kendama_cli.motion.dmp.heading import LEAST_LEAD_IN_S, CupPath, scaled_plan, swing_heading_rad, turned_plan
from kendama_cli.motion.dmp.primitive import parameters, play, with_parameters
from kendama_cli.motion.dmp.turning import cup_axes, rotations_of
from kendama_cli.schema.arrays import Array

T_S = np.linspace(0.0, 1.0, 200)


def plan(coordinates: tuple[str, ...] = ("x", "y", "z")) -> MotionPlan:
    """A primitive of random weights, mostly along x, with a turn and a variation of two demonstrations."""
    rng, c, m = np.random.default_rng(10000), len(coordinates), 6
    size = np.array([{"x": 1.0, "y": 0.2, "z": 0.5}[name] for name in coordinates])
    rotation = TurnPlan(*(0.2 * rng.standard_normal(3) for _ in range(4)), weights=rng.standard_normal((3, m)))
    return MotionPlan(
        coordinates,
        1.0,
        1.1,
        100.0,
        2.0,
        np.zeros(c),
        size * rng.standard_normal(c),
        size * rng.standard_normal(c),
        size * rng.standard_normal(c),
        300 * size[:, None] * rng.standard_normal((c, m)),
        np.exp(-np.linspace(0, 2, m)),
        np.full(m, 20.0),
        rng.standard_normal((2, 1 + c * (3 + m))),
        rotation,
    )


def about_z(angle: float) -> Array:
    return np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])


@pytest.mark.parametrize("angle_deg", [20, 45, 90, 180, -137])
def test_all_of_a_primitive_is_turned_path_cup_and_how_demonstrations_differ(angle_deg: float) -> None:
    angle, one = math.radians(angle_deg), plan()
    made = turned_plan(one, angle)
    desired = play(one, T_S).position_m @ about_z(angle).T
    assert play(made, T_S).position_m == pytest.approx(desired, abs=1e-12)
    axes = cup_axes(rotations_of(one, T_S)) @ about_z(angle).T
    assert cup_axes(rotations_of(made, T_S)) == pytest.approx(axes, abs=1e-12)
    assert swing_heading_rad(made) == pytest.approx(
        math.remainder(swing_heading_rad(one) + angle, 2 * math.pi), abs=1e-9
    )
    # one demonstration more changes the turned plan by the turned change: the primitive is linear in its parameters
    other = with_parameters(one, parameters(one) + one.variation[0])
    again = with_parameters(made, parameters(made) + made.variation[0])
    desired = play(other, T_S * other.duration_s).position_m @ about_z(angle).T
    assert play(again, T_S * again.duration_s).position_m == pytest.approx(desired, abs=1e-9)


@pytest.mark.parametrize(
    ("coordinates", "heading_deg"), [(("x", "z"), (0, 180)), (("y", "z"), (90, -90)), (("z",), (0,))]
)
def test_a_primitive_of_fewer_coordinates_is_one_in_space(
    coordinates: tuple[str, ...], heading_deg: tuple[int, ...]
) -> None:
    one = plan(coordinates)
    assert round(math.degrees(swing_heading_rad(one))) in heading_deg
    made = turned_plan(one, math.pi / 2)
    path = np.zeros((len(T_S), 3))
    path[:, ["xyz".index(name) for name in coordinates]] = play(one, T_S).position_m
    assert play(made, T_S).position_m == pytest.approx(path @ about_z(math.pi / 2).T, abs=1e-12)


def test_a_mirrored_swing_goes_the_other_way_in_the_same_plane() -> None:
    one = dataclasses.replace(plan(("x", "z")), turn=None)
    mirror = np.array([-1.0, 1.0])
    changed = {name: mirror * getattr(one, name) for name in ("start_velocity_m_s", "goal_m", "goal_velocity_m_s")} | {
        "weights": mirror[:, None] * one.weights
    }
    other = dataclasses.replace(one, **changed)
    assert abs(math.remainder(swing_heading_rad(other) - swing_heading_rad(one) - math.pi, 2 * math.pi)) < 1e-9
    inward = [turned_plan(each, 0.3 - swing_heading_rad(each)) for each in (one, other)]
    assert play(inward[0], T_S).position_m == pytest.approx(play(inward[1], T_S).position_m, abs=1e-12)


@pytest.mark.parametrize("size", [1.0, 1e-2, 0.0])
def test_a_path_that_begins_moving_is_led_into_by_a_quartic_from_rest(size: float) -> None:
    """a u^3 + b u^4 has at its end the primitive's velocity and acceleration; it lasts 2 v / a, or a few periods."""
    one = dataclasses.replace(plan(("x", "z")), start_m=np.array([0.1, -0.2]))
    one = dataclasses.replace(one, start_velocity_m_s=size * one.start_velocity_m_s)
    made, first = CupPath(one, 3.0), play(dataclasses.replace(one, tau_scale=1.0), np.zeros(1))
    speed = float(np.linalg.norm(one.start_velocity_m_s))
    assert made.lead_in_s == (max(2 * speed / 3.0, LEAST_LEAD_IN_S) if size else 0.0)
    assert made.duration_s == pytest.approx(made.lead_in_s + 1.5 * one.duration_s)
    after = np.linspace(0.0, 1.4, 9)
    swung = play(dataclasses.replace(one, tau_scale=1.0), after).position_m
    assert made.at(made.lead_in_s + after + 1e-12)[:, [0, 2]] == pytest.approx(swung, abs=1e-9)
    assert not made.at(after)[:, 1].any()
    if size:
        u = np.linspace(0.0, 1.0, 9, endpoint=False)[:, None]
        rate, bend = first.velocity_m_s * made.lead_in_s, first.acceleration_m_s2 * made.lead_in_s**2
        a, b = np.linalg.solve([[3.0, 4.0], [6.0, 12.0]], np.vstack((rate, bend)))
        wanted = first.position_m - a - b + a * u**3 + b * u**4
        assert made.at(made.lead_in_s * u[:, 0])[:, [0, 2]] == pytest.approx(wanted, abs=1e-9)


def test_a_scaled_plan_plays_the_scaled_path_and_so_do_its_variations() -> None:
    one = dataclasses.replace(plan(), start_m=np.array([0.1, -0.2, 0.3]))
    made = scaled_plan(one, 0.7, 1.4)
    varied = [with_parameters(each, parameters(each) + each.variation[1]) for each in (one, made)]
    for way, scaled in ((one, made), varied):
        path = play(dataclasses.replace(way, tau_scale=1.4), T_S).position_m - one.start_m
        assert play(scaled, T_S).position_m - one.start_m == pytest.approx(0.7 * path, abs=1e-9)
