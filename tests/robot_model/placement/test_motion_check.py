"""Each limit of a motion at its edge, beside numbers of the arm's own forward kinematics."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.errors import StageError
from kendama_cli.robot_model.placement.motion_check import (
    check_motion,
    efforts_nm,
    limit_ratios,
    require_allowed,
)
from kendama_cli.schema.settings import build
from kendama_cli.settings.safety import SafetySettings
from tests.shipped_conf import plain
from tests.simulation.dart.bench_robot import bench_arm, kendama_game, modelled

GAME, SAFETY = kendama_game(), build(SafetySettings, plain("safety", "default"), "safety")
ARM = modelled(bench_arm())
T = np.linspace(0.0, 1.0, 501)
SWAY = np.array([0.1, -0.05, 0.2, 0.1, 0.3, -0.2, 0.4])


def _motion() -> JointTrajectory:
    """A sine of every joint about home, whose speeds and accelerations are known."""
    wave = [np.outer(one, SWAY) for one in (np.sin(5 * T), 5 * np.cos(5 * T), -25 * np.sin(5 * T))]
    return JointTrajectory(ARM.joint_names, T, ARM.home_rad + wave[0], wave[1], wave[2])


def _number(text: str) -> float:
    return float(re.findall(r"-?[\d.]+", text)[0])


def test_ratios_are_the_peaks_over_the_limits() -> None:
    found, joints, limits = limit_ratios(ARM, _motion()), _motion(), ARM.limits
    assert found.velocity == pytest.approx(5 * np.abs(SWAY) / limits.velocity_rad_s, rel=1e-3)
    assert found.acceleration == pytest.approx(25 * np.abs(SWAY) / limits.acceleration_rad_s2, rel=1e-3)
    q, v, a = joints.position_rad, joints.velocity_rad_s, joints.acceleration_rad_s2
    torque = np.array([ARM.rigid_effort_nm(*row) for row in zip(q, v, a, strict=True)])
    torque += ARM.friction.torque_nm(v, np.sign(v))
    assert efforts_nm(ARM, joints) == pytest.approx(torque[::2])  # 4 ms
    assert found.effort == pytest.approx(np.abs(torque).max(axis=0) / limits.effort_nm, rel=0.01)
    stop = np.minimum(q - limits.lower_rad, limits.upper_rad - q).min(axis=0)
    assert found.to_stop_rad == pytest.approx(stop)
    center, half = (limits.upper_rad + limits.lower_rad) / 2, (limits.upper_rad - limits.lower_rad) / 2
    assert found.position == pytest.approx((np.abs(q - center) / half).max(axis=0))


def test_every_limit_holds_at_its_edge_and_not_beyond_it_and_tells_the_motion_s_own_number() -> None:
    joints = _motion()
    q = joints.position_rad
    ratios, rows = limit_ratios(ARM, joints), [*range(0, 501, 5)]
    cup = np.array([ARM.tool_position_m(q[k]) for k in rows])
    heights = np.array([ARM.joint_positions_m(q[k])[:, 2] for k in rows])
    links = (np.minimum(heights[:, 1:-1], heights[:, 2:]) - ARM.link_radius_m[1:]).min()
    lowest = min(links, cup[:, 2].min() - GAME.cup.reach_m)
    first = {one.what: one for one in check_motion(ARM, GAME, joints, SAFETY)}
    assert all(one.holds for one in first.values())
    gap_m = 1e-3 * _number(first["gap"].found)
    assert _number(first["table"].found) == pytest.approx(1e3 * (lowest - SAFETY.table_height_m), abs=0.6)
    top = ratios.leading[0].ratio
    stop = ratios.to_stop_rad.min()
    edges = [
        (ratios.leading[0].kind, "limit_ratio", top, -1e-4),
        ("stop", "to_stop_rad", stop, 1e-4),
        ("gap", "gap_m", gap_m, 2e-3),
        ("table", "table_height_m", lowest - SAFETY.gap_m, 1e-4),
    ]
    for axis, name in enumerate("xyz"):
        low, high = cup[:, axis].min(), cup[:, axis].max()
        assert [float(one) for one in re.findall(r"-?\d+\.\d+", first[f"cup, {name}"].found)] == pytest.approx(
            [low, high], abs=6e-4
        )
        edges += [(f"cup, {name}", ("cup_low_m", axis), low, 1e-4), (f"cup, {name}", ("cup_high_m", axis), high, -1e-4)]
    for what, field, edge, beyond in edges:
        for step, holds in ((-beyond, True), (beyond, False)):
            value = edge + step
            if isinstance(field, tuple):
                corner = list(getattr(SAFETY, field[0]))
                corner[field[1]] = value
                safety = dataclasses.replace(SAFETY, **{field[0]: tuple(corner)})
            else:
                safety = dataclasses.replace(SAFETY, **{field: float(value)})
            checked = {one.what: one for one in check_motion(ARM, GAME, joints, safety)}
            assert checked[what].holds == holds, (what, field)
            if not holds:
                with pytest.raises(StageError, match=re.escape(f"{what}: {checked[what].found}, allowed: ")):
                    require_allowed(checked.values())
