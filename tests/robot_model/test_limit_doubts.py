"""Each doubt about a file's limits, at its edge, and none beside it."""

from __future__ import annotations

import math

import pytest

from kendama_cli.robot_model.limit_doubts import doubts_of, placeholder_in

NAMES = ("a", "b")
SOURCES = {"velocity_rad_s": "the file's velocity", "effort_nm": "the file's effort"}


def _doubts(turns: float = 1.0, top: float = 2.0, dry: float = 1.0, viscous: float = 1.0, effort: float = 9.0) -> str:
    half = turns * math.pi
    limits = {"lower_rad": (-1.0, -half), "upper_rad": (1.0, half), "velocity_rad_s": (1.5, top)}
    friction = {"coulomb_nm": (0.0, dry), "viscous_nm_s": (0.0, viscous)}
    return " | ".join(doubts_of(NAMES, limits | {"effort_nm": (5.0, effort)}, friction, SOURCES))


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({}, ""),
        ({"turns": 2.0}, ""),
        ({"turns": 2.1}, "more than two turns in b"),
        ({"turns": 999.0 / math.pi}, ""),  # as a joint without stops is given
        ({"top": 50.0, "viscous": 0.0}, ""),
        ({"top": 51.0, "viscous": 0.0}, "more than 50 rad/s in b"),
        ({"viscous": 3.9}, ""),
        ({"viscous": 4.1}, "friction at top speed is beyond the effort limit: b"),
        ({"dry": 8.0, "viscous": 0.6}, "friction at top speed is beyond the effort limit: b"),
    ],
)
def test_limits_that_no_arm_has_are_doubted(values: dict[str, float], told: str) -> None:
    found = _doubts(**values)
    assert told in found
    assert bool(told) == bool(found)


def test_one_round_number_for_all_joints_of_a_file_is_a_placeholder() -> None:
    assert "is 10 for all 3 joints" in placeholder_in("effort_nm", (10.0,) * 3, "the file's effort")
    assert "is 0.3 for all 4 joints" in placeholder_in("effort_nm", (0.3,) * 4, "the file's effort")
    for values, source in (
        ((10.0,) * 2, "the file"),
        ((12.0,) * 3, "the file"),
        ((10.0, 10.0, 20.0), "the file"),
        ((0.0,) * 3, "the file"),
        ((10.0,) * 3, "robot.effort_nm"),
    ):
        assert not placeholder_in("effort_nm", values, source)
