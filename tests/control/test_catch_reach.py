"""An arm that cannot come to the ball in a flight is told what is missing, each with its number."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.control import catch_reach
from kendama_cli.control.corrected_motion import CupPlan
from tests.control.seen_swings import ADAPT, swing
from tests.simulation.dart.bench_robot import kendama_game

FLIGHT_S = (2.5, 2.8)


def lacking_reach(cup: CupPlan, flight_s: tuple[float, float], settings: AdaptSettings) -> str | None:
    """In the shipped cup, of whose radius 0.85 count as its mouth."""
    game = kendama_game().cup
    return catch_reach.lacking_reach(cup, flight_s, settings, rim_m=game.rim_m, mouth_m=0.85 * game.radius_m)


def wanting(reach_m: float, **changes: float) -> AdaptSettings:
    uncertainty = dataclasses.replace(ADAPT.uncertainty, name="mine", min_reach_m=reach_m, lag_s=(0.0, 0.03))
    correction = dataclasses.replace(
        ADAPT.correction,
        acceleration_m_s2=changes.get("acceleration_m_s2", ADAPT.correction.acceleration_m_s2),
        max_shift_m=changes.get("max_shift_m", ADAPT.correction.max_shift_m),
    )
    eyes = dataclasses.replace(ADAPT.sensor_model, latency_s=changes.get("latency_s", 0.01))
    return dataclasses.replace(ADAPT, uncertainty=uncertainty, correction=correction, sensor_model=eyes)


def test_the_shipped_arm_can_do_what_hard_asks_for() -> None:
    assert lacking_reach(swing().cup, FLIGHT_S, ADAPT) is None
    assert ADAPT.uncertainty.min_reach_m == 0.1


def test_a_sensor_that_is_too_late_is_named() -> None:
    assert lacking_reach(swing().cup, FLIGHT_S, wanting(0.1, latency_s=0.25)) == (
        "the ball flies 0.30 s, and 0.05 s of onset, 0.25 s of latency and 0.03 s of lag leave pa10 no time to go to "
        "it (mine asks for 100 mm): lower adapt.sensor_model.latency_s, or choose adapt/uncertainty=identified"
    )


def test_an_acceleration_that_is_too_small_is_named_with_what_it_gives() -> None:
    """0.5 * 2 * 0.21^2 = 44 mm."""
    assert lacking_reach(swing().cup, FLIGHT_S, wanting(0.1, acceleration_m_s2=2.0)) == (
        "pa10 moves the cup 44 mm while the ball flies (mine asks for 100 mm): 2.0 m/s^2 (adapt.correction."
        "acceleration_m_s2) in the 0.21 s that 0.05 s of onset, 0.01 s of latency and 0.03 s of lag leave: raise that "
        "acceleration, set adapt.uncertainty.min_reach_m=0.044, or choose adapt/uncertainty=identified"
    )


def test_an_arm_that_is_too_slow_is_named_by_its_joint() -> None:
    """The joint accelerations of least weighted squares that move the cup along x, by a pseudo-inverse."""
    cup = swing().cup
    arm, posture = cup.arm, cup.motion.position_rad[700]
    slow = dataclasses.replace(arm.limits, acceleration_rad_s2=0.1 * arm.limits.acceleration_rad_s2)
    spread = np.diag(1 / np.sqrt(arm.redundancy_weights))
    needed = np.abs(spread @ np.linalg.pinv(arm.cup_task(posture)[1] @ spread)[:, 0])
    given = slow.acceleration_rad_s2 / needed
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arm, "limits", slow)
        lacks = lacking_reach(cup, FLIGHT_S, wanting(0.1, acceleration_m_s2=1e3))
    reach_mm = 500 * given.min() * 0.21**2
    told = f"moves the cup {reach_mm:.0f} mm .* {given.min():.1f} m/s.2 .joint '{arm.joint_names[given.argmin()]}'. in"
    assert re.search(told, str(lacks))


def test_a_position_out_of_reach_is_named() -> None:
    settings = wanting(3.0, acceleration_m_s2=1e4, max_shift_m=4.0)
    arm = swing().cup.arm
    swift = dataclasses.replace(arm.limits, acceleration_rad_s2=1e6 * arm.limits.acceleration_rad_s2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arm, "limits", swift)
        lacks = lacking_reach(swing().cup, FLIGHT_S, settings)
    assert re.match(r"pa10 cannot move the cup \+3000 mm along x .*mine asks for 3000 mm", str(lacks))


def test_a_reach_beyond_the_largest_shift_names_that_setting() -> None:
    lacks = lacking_reach(swing().cup, FLIGHT_S, wanting(0.4, acceleration_m_s2=1e4))
    assert str(lacks).startswith("adapt.correction.max_shift_m is 0.3 m (mine asks for 400 mm): raise it")


def test_a_stop_that_is_met_only_on_the_path_is_no_reach() -> None:
    """The plan keeps off the first joint's stop by a milliradian; 100 mm beside it the joint would pass it."""
    made = swing()
    stop = np.array(made.arm.limits.upper_rad)
    stop[0] = made.cup.motion.position_rad[:, 0].max() + 1e-3
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(made.arm, "limits", dataclasses.replace(made.arm.limits, upper_rad=stop))
        lacks = str(lacking_reach(made.cup, FLIGHT_S, wanting(0.1)))
    told = re.search(
        r"pa10 cannot move the cup ([+-])100 mm along x .* set adapt.uncertainty.min_reach_m=(.+?),", lacks
    )
    assert told is not None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(made.arm, "limits", dataclasses.replace(made.arm.limits, upper_rad=stop))
        assert lacking_reach(made.cup, FLIGHT_S, wanting(float(told[2]))) is None


def test_where_nothing_is_asked_nothing_is_refused() -> None:
    assert lacking_reach(swing().cup, FLIGHT_S, wanting(0.0, latency_s=9.0)) is None
