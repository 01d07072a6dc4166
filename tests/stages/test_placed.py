"""Placement by search: adapt plays there, and transfer hands the robot so placed on."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import CatchMotion, MotionPlan
from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.errors import ConfigError, HardwareError, StageError
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.robot_model.placement.find_placement import current_placement, find_placement
from kendama_cli.schema.settings import build
from kendama_cli.settings.placement import LineSettings, Placement, placed
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.stages.adapt import stage as adapt_stage
from kendama_cli.stages.adapt.stage import Adapt
from kendama_cli.stages.transfer import stage as transfer_stage
from tests.memory_context import MemoryContext
from tests.motion.swings import settings as encode_settings
from tests.simulation.dart.bench_robot import ROOT, adapt_values, bench_arm, kendama_game, modelled
from tests.stages.transfer_setup import ADAPT
from tests.stages.transfer_setup import stage as transfer_of_the_arm

GAME = kendama_game()
FILE = adapt_values()
BRIEF = {"tau_range": [1.6, 1.62], "tau_start": 1.6, "amplitudes": [], "max_shift_m": 0.0, "repeats": 1}
SEARCHED = build(AdaptSettings, FILE | BRIEF | {"placement": "search"}, "adapt")


@pytest.fixture(scope="module")
def plan() -> MotionPlan:
    rows = np.loadtxt(ROOT / "data/demonstrations/swing-04.csv", delimiter=",", skiprows=3)
    return encode_demonstrations([Demonstration("swing", rows[:, 0], rows[:, 1:4])], encode_settings())


@pytest.fixture(scope="module")
def elsewhere(plan: MotionPlan) -> Placement:
    return find_placement(
        bench_arm(),
        GAME,
        plan,
        SEARCHED.lead_in_m_s2,
        line=SEARCHED.line,
        effort=0.01,  # any placement will do that is not the given one
        progress=lambda done, total, cost: None,
    )


@pytest.fixture
def motion(plan: MotionPlan, elsewhere: Placement, monkeypatch: pytest.MonkeyPatch) -> CatchMotion:
    monkeypatch.setattr(adapt_stage, "find_placement", lambda *_, **__: elsewhere)
    made: CatchMotion = (
        Adapt(adapt=SEARCHED, robot=bench_arm(), game=GAME).run({"encode": plan}, MemoryContext(1)).artifact
    )
    return made


def test_where_the_swing_ups_line_would_cost_the_motion_it_is_given_up(
    plan: MotionPlan, elsewhere: Placement, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[LineSettings | None] = []

    def find(*_: Any, line: LineSettings | None, **__: Any) -> Placement:
        asked.append(line)
        if line:
            raise StageError("the line leaves the workspace")
        return elsewhere

    monkeypatch.setattr(adapt_stage, "find_placement", find)
    made = Adapt(adapt=SEARCHED, robot=bench_arm(), game=GAME).run({"encode": plan}, MemoryContext(1)).artifact
    assert asked == [SEARCHED.line, None]
    assert made.placement == elsewhere


def test_the_motion_is_that_of_the_arm_so_placed(motion: CatchMotion, elsewhere: Placement) -> None:
    assert motion.placement == elsewhere
    assert motion.joints.position_rad[0] == pytest.approx(elsewhere.home_rad, abs=0.02)
    arm = modelled(placed(bench_arm(), elsewhere))
    value, _ = arm.cup_task(motion.joints.position_rad[200])
    assert value[3:] == pytest.approx([0.0, 0.0], abs=1e-7)


def test_a_given_placement_is_told_as_it_stands(plan: MotionPlan) -> None:
    given = dataclasses.replace(SEARCHED, placement="fixed")
    made = Adapt(adapt=given, robot=bench_arm(), game=GAME).run({"encode": plan}, MemoryContext(1)).artifact
    assert made.placement == current_placement(modelled(bench_arm()))


def test_transfer_opens_the_robot_where_the_motion_was_made_for(
    motion: CatchMotion, elsewhere: Placement, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[RobotSettings] = []

    @contextmanager
    def refuse(hardware: Any, robot: RobotSettings, game: Any) -> Iterator[None]:
        opened.append(robot)
        raise HardwareError("no robot in this test")
        yield

    monkeypatch.setattr(transfer_stage, "open_robot", refuse)
    monkeypatch.setattr(transfer_stage, "verify_policy", lambda *_: None)
    policy = PolicyArtifact.seal("table", {}, {"q": np.zeros((324, 5))})
    blind = dataclasses.replace(ADAPT, catch="open_loop")  # a visual catch is checked wherever it may go, for seconds
    with pytest.raises(HardwareError, match="no robot in this test"):
        transfer_of_the_arm(adapt=blind).run({"learn": policy, "adapt": motion}, MemoryContext(1))
    assert opened == [placed(bench_arm(), elsewhere)]


def test_only_fixed_and_search_are_known() -> None:
    with pytest.raises(ConfigError, match=r"'adapt\.placement' is 'serach', did you mean 'adapt\.placement=search'"):
        build(AdaptSettings, FILE | {"placement": "serach"}, "adapt")


def test_a_motion_out_of_every_reach_stops_adapt_in_one_line(plan: MotionPlan, monkeypatch: pytest.MonkeyPatch) -> None:
    brief = lambda *given, **named: find_placement(*given, **{**named, "effort": 0.01})  # noqa: E731
    monkeypatch.setattr(adapt_stage, "find_placement", brief)
    far = dataclasses.replace(plan, goal_m=plan.goal_m + np.array([9.0, 0.0, 0.0]))
    with pytest.raises(StageError, match=r"leaves the workspace of pa10: at [\d.]+ s"):
        Adapt(adapt=SEARCHED, robot=bench_arm(), game=GAME).run({"encode": far}, MemoryContext(1))
