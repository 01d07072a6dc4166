"""An arm that cannot come to the ball in a flight is told what is missing, each with its number."""

from __future__ import annotations

import dataclasses

import pytest

from kendama_cli.errors import StageError
from kendama_cli.game.catch_reach import require_reach
from kendama_cli.simulation.catch.settings import AdaptSettings
from tests.game.seen_swings import ADAPT, swing

FLIGHT_S = (2.5, 2.8)


def wanting(reach_m: float, **changes: float) -> AdaptSettings:
    uncertainty = dataclasses.replace(ADAPT.uncertainty, name="mine", least_reach_m=reach_m, lag_s=(0.0, 0.03))
    steering = dataclasses.replace(
        ADAPT.steering, acceleration_m_s2=changes.get("acceleration_m_s2", ADAPT.steering.acceleration_m_s2)
    )
    eyes = dataclasses.replace(ADAPT.eyes, latency_s=changes.get("latency_s", 0.01))
    return dataclasses.replace(ADAPT, uncertainty=uncertainty, steering=steering, eyes=eyes)


def test_the_shipped_arm_can_do_what_hard_asks_for() -> None:
    require_reach(swing().cup, FLIGHT_S, ADAPT)
    assert ADAPT.uncertainty.least_reach_m == 0.1


def test_eyes_that_are_too_late_are_named() -> None:
    with pytest.raises(StageError) as refused:
        require_reach(swing().cup, FLIGHT_S, wanting(0.1, latency_s=0.25))
    assert str(refused.value) == (
        "the ball flies 0.30 s, and 0.05 s of onset, 0.25 s of latency and 0.03 s of lag leave pa10 no time to go to "
        "it (mine asks for 100 mm): lower adapt.eyes.latency_s, or choose adapt/uncertainty=identified"
    )


def test_an_acceleration_that_is_too_small_is_named_with_what_it_gives() -> None:
    """0.5 * 2 * 0.21^2 = 44 mm."""
    with pytest.raises(StageError) as refused:
        require_reach(swing().cup, FLIGHT_S, wanting(0.1, acceleration_m_s2=2.0))
    assert str(refused.value) == (
        "pa10 moves the cup 44 mm while the ball flies (mine asks for 100 mm): 2.0 m/s^2 (adapt.steering."
        "acceleration_m_s2) in the 0.21 s that 0.05 s of onset, 0.01 s of latency and 0.03 s of lag leave: raise that "
        "acceleration, or choose adapt/uncertainty=identified"
    )


def test_a_place_out_of_reach_is_named() -> None:
    settings = wanting(3.0, acceleration_m_s2=1e4)
    arm = swing().cup.arm
    swift = dataclasses.replace(arm.limits, acceleration_rad_s2=1e6 * arm.limits.acceleration_rad_s2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arm, "limits", swift)
        with pytest.raises(StageError, match=r"pa10 cannot hold the cup \+3000 mm along x .*mine asks for 3000 mm"):
            require_reach(swing().cup, FLIGHT_S, settings)


def test_where_nothing_is_asked_nothing_is_refused() -> None:
    require_reach(swing().cup, FLIGHT_S, wanting(0.0, latency_s=9.0))
