"""A visual catch is checked wherever it may bring the arm, before a robot plays it."""

from __future__ import annotations

import dataclasses
import functools
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kendama_cli.control import reachable
from kendama_cli.control.reachable import Surroundings, follow_from_s
from kendama_cli.errors import StageError
from kendama_cli.settings.safety import SafetySettings
from tests.control.seen_swings import ADAPT, swing
from tests.stages.transfer_setup import GAME, SAFETY

FROM_S = 1.2
"""In the swing of seen_swings the rope slackens at 1.5 s or later."""


def held_m(safety: SafetySettings, catch: str = "visual", giving_m_s: float = 0.0) -> tuple[float, tuple[str, ...]]:
    made = swing()
    giving = dataclasses.replace(ADAPT.correction, contact_speed_m_s=giving_m_s, contact_braking_m_s2=2.0)
    adapt = dataclasses.replace(ADAPT, catch=catch, correction=giving)
    correction, told = Surroundings(made.arm, GAME, adapt, safety).correction(made.joints, FROM_S)
    return correction.max_shift_m, told


@functools.cache
def cup_m() -> np.ndarray:
    """Where the planned cup is from FROM_S on (n, 3)."""
    joints = swing().joints
    return np.array([swing().arm.tool_position_m(q) for q in joints.position_rad[joints.t_s >= FROM_S]])


def test_a_ball_is_followed_from_a_tenth_of_a_second_before_its_flight_on() -> None:
    flights: list[Any] = [SimpleNamespace(flight_start_s=one) for one in (1.5, 0.05, None)]
    assert [follow_from_s(one) for one in flights] == [1.4, 0.0, 0.0]


def test_in_the_usual_room_the_shipped_arm_is_held_off_its_own_stop_alone() -> None:
    """0.3 m beside this swing joint s3 would be beyond its stop; 0.225 m beside it is not."""
    most_m, told = held_m(SAFETY)
    assert most_m == pytest.approx(0.225)
    assert "held to 0.225 m beside its plan" in told[0]
    assert "of joint 's3', allowed: at least 0.020 rad" in told[0]


@pytest.mark.parametrize(("room_m", "share"), [(0.24, 0.75), (0.17, 0.5), (0.09, 0.25)])
def test_a_wall_beside_the_plan_bounds_the_circle(room_m: float, share: float) -> None:
    """The wall stands so far behind the last planned place; the circle's rims are a quarter of 0.3 m apart."""
    wall = dataclasses.replace(SAFETY, cup_low_m=(float(cup_m()[:, 0].min()) - room_m, *SAFETY.cup_low_m[1:]))
    most_m, told = held_m(wall)
    assert most_m == pytest.approx(share * 0.3)
    assert f"held to {most_m:g} m beside its plan" in told[0]
    assert share == 0.75 or "cup, x: from" in told[0]
    assert held_m(wall, catch="open_loop") == (0.3, ())


def test_a_seen_catch_that_has_no_room_at_all_is_refused_before_anything_moves() -> None:
    high = float(cup_m()[:, 1].max()) + 0.05
    with pytest.raises(StageError, match=r"cup, y: from .* nothing was moved"):
        held_m(dataclasses.replace(SAFETY, cup_high_m=(SAFETY.cup_high_m[0], high, SAFETY.cup_high_m[2])))


def test_a_cup_that_gives_way_needs_room_below_and_above_the_plan() -> None:
    """At 0.3 m/s against 2 m/s^2 it goes down by v^2 / 2a = 22.5 mm, and before that up by 4/27 of 0.6 s, 26.7 mm."""
    low, high = cup_m().min(axis=0), cup_m().max(axis=0)

    def room(below_m: float, above_m: float) -> SafetySettings:
        lower = (low[0] - 0.09, SAFETY.cup_low_m[1], low[2] - below_m)  # a wall that ends the second circle soon
        return dataclasses.replace(SAFETY, cup_low_m=lower, cup_high_m=(*SAFETY.cup_high_m[:2], high[2] + above_m))

    assert held_m(room(0.025, 0.029), giving_m_s=0.3)[0] == pytest.approx(0.25 * 0.3)
    for below_m, above_m in ((0.02, 0.029), (0.025, 0.024)):
        with pytest.raises(StageError, match=r"cup, z: from .* nothing was moved"):
            held_m(room(below_m, above_m), giving_m_s=0.3)


def test_a_stop_that_the_plan_keeps_off_and_the_catch_beside_it_does_not_is_found() -> None:
    made = swing()
    plan = reachable.check_places(made.arm, GAME, made.joints, SAFETY)
    assert all(one.holds for one in plan)
    stop = np.array(made.arm.limits.upper_rad)
    stop[0] = made.joints.position_rad[:, 0].max() + SAFETY.to_stop_rad + 1e-3
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(made.arm, "limits", dataclasses.replace(made.arm.limits, upper_rad=stop))
        with pytest.raises(StageError, match=r"stop: .*nothing was moved"):
            held_m(SAFETY)
