"""The arm plays the cup's tilt as far as it can, and says what it left out."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from kendama_cli.adaptation import catch_family
from kendama_cli.adaptation.catch_family import playable_tilt
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.dmp.averaging import encode, prepare
from kendama_cli.motion.dmp.turning import cup_axes, encode_rotations, rotations_of
from kendama_cli.motion.rotation import exponential
from kendama_cli.robot_model.arm_motion import KNOT_S, ArmMotion
from kendama_cli.schema.settings import build
from tests.motion.swings import settings as encode_settings
from tests.simulation.dart.bench_robot import ROOT, adapt_values, bench_arm, modelled

SHIPPED = build(AdaptSettings, adapt_values(), "adapt")


@pytest.fixture(scope="module")
def arm():
    return modelled(bench_arm())


def plan(size_rad, axis):
    rows = np.loadtxt(ROOT / "data/demonstrations/swing-04.csv", delimiter=",", skiprows=3)
    t_s = rows[:, 0]
    turned = exponential(size_rad * np.sin(np.pi * np.clip(t_s / t_s[-1], 0, 1))[:, None] ** 2 * np.array(axis))
    swings = [Demonstration("swing", t_s, rows[:, 1:4], turned)]
    encoding = encode(prepare(swings, encode_settings()), encode_settings())
    return dataclasses.replace(encoding.average(), turn=encode_rotations(swings, encoding, encode_settings())[0])


def test_the_cup_points_where_it_was_turned_to(arm):
    chosen, told = playable_tilt(arm, plan(0.3, [0.0, 1.0, 0.0]), SHIPPED)
    assert told == ()
    swing = ArmMotion(arm, chosen, SHIPPED.lead_in_m_s2)
    made = swing.joints(1.0, 0.1)
    every = round(KNOT_S / 0.001) * 10
    desired = cup_axes(rotations_of(chosen, made.t_s[::every] - swing.lead_in_s))
    for angles, axis in zip(made.position_rad[::every], desired, strict=True):
        assert arm.tool_pose(angles).rotation[:, 2] == pytest.approx(axis, abs=1e-6)
    assert desired[:, 0].max() == pytest.approx(np.sin(0.3), abs=0.01)


def test_the_turn_about_the_cups_own_axis_is_left_out_and_told(arm):
    chosen, told = playable_tilt(arm, dataclasses.replace(plan(0.5, [0.0, 0.0, 1.0]), tau_scale=2.0), SHIPPED)
    assert told == ("left out: the cup's rotation about its own axis, up to 29 deg; the cup is round",)
    assert chosen.turn is not None


def test_a_tilt_that_the_arm_cannot_play_is_made_less_and_told(arm):
    chosen, (told,) = playable_tilt(arm, plan(2.6, [0.0, 1.0, 0.0]), SHIPPED)
    assert "the cup's tilt of up to 149 deg is played to" in told
    assert "joint '" in told or "cannot hold" in told
    assert chosen.turn is None or np.abs(chosen.turn.weights).max() < np.abs(plan(2.6, [0, 1, 0]).turn.weights).max()


def test_without_a_share_the_cup_stays_upright_and_it_is_told(arm):
    chosen, told = playable_tilt(arm, plan(0.3, [0.0, 1.0, 0.0]), dataclasses.replace(SHIPPED, tilt_fraction=0.0))
    assert chosen.turn is None
    assert told == ("the cup's tilt of up to 17 deg is played to 0% only: adapt.tilt_fraction=0",)


@pytest.mark.parametrize(("allowed", "played"), [(0.9, 0.8), (0.7, 0.6), (0.3, 0.2), (0.1, 0.0)])
def test_quarters_of_the_wanted_share_are_left_out_until_the_arm_can_do_it(
    monkeypatch: pytest.MonkeyPatch, allowed: float, played: float
) -> None:
    """Arm that can turn the cup by so large a share of 0.6 rad, where 0.8 of the turn is wanted."""
    one, settings = plan(0.6, [0.0, 1.0, 0.0]), dataclasses.replace(SHIPPED, tilt_fraction=0.8)
    most = np.abs(one.turn.weights).max()

    def moved(arm: object, tried: MotionPlan, lead_in_m_s2: float) -> SimpleNamespace:
        share = np.abs(tried.turn.weights).max() / most
        slow = settings.tau_range[1] * (1.01 if share > allowed else 0.99)
        return SimpleNamespace(min_tau_scale=lambda: slow, limiting_joint=lambda: "joint 's3'")

    monkeypatch.setattr(catch_family, "ArmMotion", moved)
    chosen, (told,) = playable_tilt(None, one, settings)
    shown = 0.0 if chosen.turn is None else np.abs(chosen.turn.weights).max() / most
    assert shown == pytest.approx(played)
    reason = "adapt.tilt_fraction" if played == 0.8 else "joint 's3'"
    assert told == f"the cup's tilt of up to 34 deg is played to {played:.0%} only: {reason}"
