"""The cup off its line: where it then is, and what the joints may."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from kendama_cli.control.catch_controller import TiltPlan
from kendama_cli.control.cup_cart import CupTilt, TiltingArm
from kendama_cli.control.settings import CatchSettings
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.placement import CupLine
from tests.control.observed_games import TRANSFER
from tests.simulation.dart.bench_robot import bench_arm, modelled

H = 0.004
X = np.array([1.0, 0.0, 0.0])
TILTING: CatchSettings = dataclasses.replace(TRANSFER.catch, max_tilt_rad=0.4, contact_speed_m_s=0.5)


@pytest.fixture(scope="module")
def arm() -> RobotModel:
    return modelled(bench_arm())


@pytest.fixture(scope="module")
def line(arm: RobotModel) -> CupLine:
    return CupLine(arm, 0.1)


def test_the_cup_is_where_and_as_tilted_as_commanded(arm: RobotModel, line: CupLine) -> None:
    tilting = TiltingArm(arm, line.home_m, X, H)
    tilting.begin(line.home_rad, np.zeros(7))
    for k in range(1, 101):
        part, rate = (k / 100) ** 2, k / 50 / (100 * H)
        tilt = CupTilt(0.02 * part, 0.02 * rate, 0.3 * part, 0.3 * rate)
        command = tilting.at(0.05 * part, 0.05 * rate, tilt) or pytest.fail("within the limits")
        place = arm.tool_pose(command.position_rad)
        assert place.position_m == pytest.approx(line.home_m + np.array([0.05 * part, 0, 0.02 * part]), abs=1e-5)
        assert place.rotation[:, 2] == pytest.approx([np.sin(0.3 * part), 0, np.cos(0.3 * part)], abs=1e-5)
    after = tilting.at(0.05 + 0.25 * H, 0.25, CupTilt(0.02 + 0.1 * H, 0.1, 0.3 + 1.5 * H, 1.5))
    assert after is not None
    assert H * after.acceleration_rad_s2 == pytest.approx(after.velocity_rad_s - command.velocity_rad_s)
    assert after.position_rad - command.position_rad == pytest.approx(H * after.velocity_rad_s, abs=5e-5)


def test_without_tilt_it_is_the_line(arm: RobotModel, line: CupLine) -> None:
    tilting = TiltingArm(arm, line.home_m, X, H)
    tilting.begin(line.home_rad, line.at(0.0, 0.4, 0.0).velocity_rad_s)
    for k in range(1, 40):
        command = tilting.at(0.4 * H * k, 0.4, CupTilt()) or pytest.fail("within the limits")
        wanted = line.at(0.4 * H * k, 0.4, 0.0)
        assert command.position_rad == pytest.approx(wanted.position_rad, abs=1e-5)
        assert command.velocity_rad_s == pytest.approx(wanted.velocity_rad_s, abs=1e-4)


def test_what_the_joints_cannot_do_is_refused(arm: RobotModel, line: CupLine) -> None:
    tilting = TiltingArm(arm, line.home_m, X, H)
    tilting.begin(line.home_rad, np.zeros(7))
    assert tilting.at(0.0, 0.0, CupTilt(tilt_rad=0.5, tilt_rad_s=30.0)) is None


def test_the_tilt_is_there_at_the_catch_and_the_cup_gives_with_the_ball() -> None:
    plan = TiltPlan(TILTING, H)
    tilts = [plan.next(H * k, 0.3, 0.25) for k in range(300)]
    cubic = CubicHermiteSpline([0.0, 0.3], [0.0, 0.25], [0.0, 0.0])
    assert tilts[0].tilt_rad_s == pytest.approx(float(cubic(H, 1)))
    assert tilts[0].tilt_rad == pytest.approx(0.5 * H * tilts[0].tilt_rad_s)
    meets = tilts[round(0.3 / H) - 1]
    assert meets.tilt_rad == pytest.approx(0.25, abs=0.005)
    assert meets.tilt_rad_s == pytest.approx(0.0, abs=0.1)
    assert meets.lift_m == pytest.approx(0.0, abs=0.002)
    assert meets.lift_m_s == pytest.approx(-0.5, abs=0.05)
    assert tilts[-1].tilt_rad == pytest.approx(0.0, abs=1e-3)
    assert tilts[-1].lift_m_s == pytest.approx(0.0, abs=1e-9)
    assert tilts[-1].lift_m > -0.05


def test_a_catch_too_near_to_plan_for_leaves_the_cup_as_it_is() -> None:
    near_s = 0.5 * TILTING.freeze_before_catch_s
    assert TiltPlan(TILTING, H).next(0.0, near_s, 0.25) == CupTilt()


@pytest.mark.parametrize(("across", "wanted"), [(0.5, -np.arctan(0.25)), (-0.5, np.arctan(0.25)), (9.0, -0.4)])
def test_the_cup_opens_against_the_relative_velocity(across: float, wanted: float) -> None:
    assert TiltPlan(TILTING, H).tilt_rad(np.array([across, -2.0])) == pytest.approx(wanted)


def test_settings_that_want_neither_leave_the_cup_on_its_line() -> None:
    assert TiltPlan(dataclasses.replace(TILTING, max_tilt_rad=0.0, contact_speed_m_s=0.0), H).flat
    assert not TiltPlan(TILTING, H).flat
