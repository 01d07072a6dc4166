"""A swing that goes another way than along x: the same windows, and on an arm that stays the same tau."""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
import pytest

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.schema.settings import build
from kendama_cli.settings.placement import turned
from kendama_cli.stages.adapt.stage import Adapt
from kendama_cli.stages.interface import StageResult
from tests.memory_context import MemoryContext
from tests.motion.swings import settings as encode_settings
from tests.simulation.dart.bench_robot import ROOT, adapt_values, bench_arm, kendama_game

SHIPPED = build(AdaptSettings, adapt_values(), "adapt")
QUICK = dataclasses.replace(SHIPPED, tau_range=(0.92, 1.04), amplitudes=(), max_shift_m=0.0, repeats=1)


@functools.cache
def adapted(heading_deg: float, *, mirrored: bool = False, base_deg: float = 0.0) -> tuple[StageResult, MemoryContext]:
    """The bundled swing number 4, turned about z after it was mirrored, by an arm whose base is turned."""
    rows = np.loadtxt(ROOT / "data/demonstrations/swing-04.csv", delimiter=",", skiprows=3)
    x, y, z = (rows[:, 1:4] - rows[0, 1:4]).T
    y = 0.0 * y  # in one plane, so that the mirrored one is a turned one
    if mirrored:
        x = -x
    c, s = math.cos(math.radians(heading_deg)), math.sin(math.radians(heading_deg))
    swing = Demonstration("swing", rows[:, 0], np.column_stack([c * x - s * y, s * x + c * y, z]))
    plan = encode_demonstrations([swing], encode_settings())
    ctx = MemoryContext(10000)
    robot = turned(bench_arm(), math.radians(base_deg))
    return Adapt(adapt=QUICK, robot=robot, game=kendama_game()).run({"encode": plan}, ctx), ctx


def windows(ctx: MemoryContext) -> list[tuple[float, float, float]]:
    return [(one.low, one.high, one.middle) for topic, _, one in ctx.log.messages if topic == "/adapt/window"]


def misses(ctx: MemoryContext) -> list[tuple[float, float]]:
    return [(one.tau_scale, one.signed_miss_m) for topic, _, one in ctx.log.messages if topic == "/adapt/rollout"]


@pytest.mark.parametrize(
    ("heading_deg", "mirrored"),
    [
        (20.0, True),
        pytest.param(20.0, False, marks=pytest.mark.slow),
        pytest.param(180.0, True, marks=pytest.mark.slow),
        pytest.param(45.0, False, marks=pytest.mark.slow),
        pytest.param(90.0, False, marks=pytest.mark.slow),
        pytest.param(180.0, False, marks=pytest.mark.slow),
    ],
)
def test_where_base_and_draws_turn_along_a_turned_swing_has_the_same_windows(
    heading_deg: float, mirrored: bool
) -> None:
    base_deg = heading_deg + 180.0 * mirrored
    one, two = adapted(0.0), adapted(heading_deg, mirrored=mirrored, base_deg=base_deg)
    assert windows(one[1])
    assert np.array(windows(two[1])) == pytest.approx(np.array(windows(one[1])), abs=1e-6)
    assert np.array(misses(two[1])) == pytest.approx(np.array(misses(one[1])), abs=1e-6)
    assert two[0].metrics["success_rate"] == one[0].metrics["success_rate"] == 1.0
    # the result is turned back: joints as they were, the primitive and the base where they stand
    before, after = one[0].artifact, two[0].artifact
    assert after.joints.position_rad == pytest.approx(before.joints.position_rad, abs=1e-6)
    angle = math.radians(base_deg)
    assert np.hypot(*after.plan.goal_m[:2]) == pytest.approx(np.hypot(*before.plan.goal_m[:2]), abs=1e-9)
    assert math.remainder(
        after.placement.base_heading_rad - before.placement.base_heading_rad - angle, 2 * math.pi
    ) == (pytest.approx(0.0, abs=1e-12))
    cups = [[m.position_m for topic, _, m in ctx.log.messages if topic == "/adapt/cup"] for _, ctx in (one, two)]
    c, s = math.cos(angle), math.sin(angle)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    assert np.array(cups[1]) == pytest.approx(np.array(cups[0]) @ rotation.T, abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("heading_deg", [20.0, 45.0, 180.0])
def test_an_arm_that_stays_catches_a_turned_swing_at_the_same_tau(heading_deg: float) -> None:
    """At 90 degrees the PA10 as it stands would have to play the swing twice as slow."""
    made = adapted(heading_deg)[0]
    assert made.metrics["caught"] is True
    assert float(made.metrics["tau_scale"] or 0) == pytest.approx(
        float(adapted(0.0)[0].metrics["tau_scale"] or 0), abs=0.01
    )
    assert made.metrics["heading_deg"] == pytest.approx(
        math.remainder(heading_deg + float(adapted(0.0)[0].metrics["heading_deg"] or 0), 360.0), abs=1e-6
    )
