"""The first tries of a motion on an arm: what is not allowed moves nothing, and what was measured is kept."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory, MotionPlan
from kendama_cli.devices.robot.interface import Exchange, JointCommand
from kendama_cli.devices.robot.rebuilt import RebuiltRobot, open_simulated
from kendama_cli.errors import ConfigError, HardwareError, StageError
from kendama_cli.motion import minimum_jerk
from kendama_cli.plugins.rehearsal import stage as rehearse_stage
from kendama_cli.plugins.rehearsal.artifact import Rehearsal
from kendama_cli.plugins.rehearsal.settings import RehearseSettings
from kendama_cli.plugins.rehearsal.stage import Rehearse
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.find_placement import current_placement
from kendama_cli.robot_model.placement.motion_check import check_motion
from kendama_cli.schema.settings import build, build_value
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings, SimulatedHardware
from kendama_cli.settings.safety import SafetySettings
from kendama_cli.stages.interface import StageResult
from tests.memory_context import MemoryContext
from tests.shipped_conf import plain
from tests.simulation.dart.bench_robot import bench_arm

GAME: GameSettings = build_value(GameSettings, plain("game", "kendama"), "game")
SAFETY = build(SafetySettings, plain("safety", "default"), "safety")
SHIPPED = build(RehearseSettings, plain("rehearse", "slow"), "rehearse")
FULL = dataclasses.replace(SHIPPED, speed=1.0)
DIRECT: SimulatedHardware = build_value(HardwareSettings, plain("hardware", "simulated"), "hardware")
ARM = RobotModel(bench_arm(), GAME.cup, GAME.gravity_m_s2)


def swing(reach_rad: float = 0.1, span_s: float = 0.5, joint: int | None = None) -> JointTrajectory:
    """Joints by minimum jerk away from home, there and back."""
    t_s = np.arange(0.0, 2 * span_s + 1e-9, 0.004)
    fraction = np.minimum(t_s, 2 * span_s - t_s) / span_s
    sign = np.where(t_s <= span_s, 1.0, -1.0)
    path = np.full(7, reach_rad) if joint is None else reach_rad * (np.arange(7) == joint)
    step, rate, change = (
        np.asarray(one(fraction))[:, None]
        for one in (minimum_jerk.step, minimum_jerk.step_rate, minimum_jerk.step_change)
    )
    return JointTrajectory(
        ARM.joint_names,
        t_s,
        ARM.home_rad + step * path,
        sign[:, None] * rate / span_s * path,
        change / span_s**2 * path,
    )


def catch_motion(joints: JointTrajectory) -> CatchMotion:
    plan = object.__new__(MotionPlan)  # the stage looks at the joints' motion alone
    return CatchMotion(plan, joints, current_placement(ARM), caught=True, success_rate=1.0)


def rehearsed(
    joints: JointTrajectory, settings: RehearseSettings = FULL, safety: SafetySettings = SAFETY
) -> tuple[StageResult, MemoryContext]:
    ctx = MemoryContext(seed=0)
    stage = Rehearse(rehearse=settings, safety=safety, hardware=DIRECT, robot=bench_arm(), game=GAME)
    return stage.run({"adapt": catch_motion(joints)}, ctx), ctx


def logged(ctx: MemoryContext, topic: str) -> list[Any]:
    return [message for name, _, message in ctx.log.messages if name == topic]


def spoil(monkeypatch: pytest.MonkeyPatch, how: Any, at: int = 50) -> list[JointCommand]:
    """Have robots that ``open_robot`` opens answer by ``how`` from period ``at`` on; the commands they were given."""
    commands: list[JointCommand] = []

    @contextmanager
    def open_spoiled(*arguments: Any) -> Iterator[RebuiltRobot]:
        with open_simulated(*arguments) as robot:
            true = robot.exchange

            def exchange(command: JointCommand) -> Exchange:
                commands.append(command)
                told = true(command)
                return how(told) if len(commands) > at else told

            robot.exchange = exchange  # type: ignore[method-assign]
            yield robot

    monkeypatch.setattr(rehearse_stage, "open_robot", open_spoiled)
    return commands


def test_a_motion_is_played_and_every_command_and_reading_is_logged() -> None:
    joints = swing()
    made, ctx = rehearsed(joints)
    result: Rehearsal = made.artifact
    assert made.metrics["completed"] is True
    assert result.stopped == ""
    assert made.warnings == ()
    k = len(result.t_s)
    assert result.t_s[-1] == pytest.approx(1.0 + 0.6)
    assert [len(logged(ctx, f"/rehearse/{name}")) for name in ("sent", "measured", "ghost")] == [k, k, k]
    assert np.array_equal([list(one.position_rad) for one in logged(ctx, "/rehearse/sent")], result.sent_rad)
    assert np.array_equal([list(one.position_rad) for one in logged(ctx, "/rehearse/measured")], result.measured_rad)
    assert np.abs(result.sent_rad[: len(joints.t_s) - 1] - joints.position_rad[1:]).max() < 1e-9
    assert made.metrics["twin_deviation_max_mrad"] < 1e-9  # the same model, the same commands


def test_a_tenth_of_the_speed_takes_ten_times_as_long() -> None:
    made, _ = rehearsed(swing(span_s=0.3), SHIPPED)
    rates = np.abs(np.diff(made.artifact.sent_rad, axis=0)).max() / 0.004
    assert made.metrics["played_s"] == pytest.approx(6.0 + 0.6)
    assert rates == pytest.approx(0.1 * 1.875 * 0.1 / 0.3, rel=0.01)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"limit_ratio": 0.01}, r"speed: .* of joint '\w+', allowed: at most"),
        ({"to_stop_rad": 3.0}, r"stop: .* rad to that of joint '\w+', allowed: at least 3\.000 rad"),
        ({"gap_m": 0.8}, r"gap: .* mm between .*, allowed: at least 800 mm"),
        ({"table_height_m": 1.2}, r"table: -\d+ mm under the (link of '\w+'|cup) at .* s, allowed: at least 10 mm"),
        ({"cup_high_m": (0.8, 0.6, 0.31)}, r"cup, z: from .* to .* m, allowed: from 0\.300 to 0\.310 m"),
        ({"cup_low_m": (0.7, -0.6, 0.3)}, "cup, x: from"),
    ],
    ids=["limits", "stops", "gap", "table", "box_above", "box_beside"],
)
def test_what_is_not_allowed_moves_nothing(change: dict[str, Any], says: str, monkeypatch: pytest.MonkeyPatch) -> None:
    commands = spoil(monkeypatch, lambda told: told)
    with pytest.raises(StageError, match=says) as caught:
        rehearsed(swing(), safety=dataclasses.replace(SAFETY, **change))
    assert "nothing was moved" in str(caught.value)
    assert not commands


def test_a_motion_that_the_twin_cannot_follow_moves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    commands = spoil(monkeypatch, lambda told: told)
    with pytest.raises(StageError, match=r"the twin comes .* rad away .* in joint '\w+'; allowed: 1e-06 .*nothing was"):
        rehearsed(swing(), dataclasses.replace(FULL, max_twin_deviation_rad=1e-6))
    assert not commands


def test_an_arm_of_other_joints_is_not_moved() -> None:
    other = dataclasses.replace(swing(), joint_names=tuple("abcdefg"))
    with pytest.raises(StageError, match=r"the imitation motion is for the joints a, b, c.*nothing was moved"):
        rehearsed(other)


def away(told: Exchange) -> Exchange:
    return dataclasses.replace(told, state=dataclasses.replace(told.state, position_rad=told.state.position_rad + 0.2))


def unknown(told: Exchange) -> Exchange:
    nothing = np.full(7, np.nan)
    return dataclasses.replace(told, state=dataclasses.replace(told.state, position_rad=nothing))


def gone(told: Exchange) -> Exchange:
    raise HardwareError("the robot at 10.0.0.2:47700: nothing listens there")


@pytest.mark.parametrize(
    ("how", "says"),
    [
        (away, r"joint '\w+' is 0\.2\d\d rad from where it was sent; allowed: 0\.15 .*; the arm was halted"),
        (unknown, r"joint '\w+' is measured at nan rad; the arm was halted"),
        (gone, "nothing listens there"),
    ],
    ids=["away", "no_number", "gone"],
)
def test_an_arm_that_fails_is_halted_and_what_was_measured_is_kept(
    how: Any, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    commands = spoil(monkeypatch, how)
    made, ctx = rehearsed(swing())
    assert made.metrics["completed"] is False
    (warning,) = made.warnings
    assert warning.startswith("the arm stopped after 0.20 s: ")
    assert len(commands) == 51, "nothing is commanded after the fault"
    kept = made.artifact
    assert len(kept.t_s) == (51 if how is away else 50)
    assert len(logged(ctx, "/rehearse/measured")) == len(kept.t_s)
    assert re.search(says, kept.stopped)


def test_an_arm_that_fails_at_once_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    spoil(monkeypatch, gone, at=0)
    with pytest.raises(HardwareError, match="nothing listens there"):
        rehearsed(swing())


def test_an_arm_that_allows_less_than_its_description_is_not_moved(monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def open_weak(*arguments: Any) -> Iterator[RebuiltRobot]:
        with open_simulated(*arguments) as robot:
            robot.limits = dataclasses.replace(robot.limits, velocity_rad_s=robot.limits.velocity_rad_s * 0.1)
            yield robot

    monkeypatch.setattr(rehearse_stage, "open_robot", open_weak)
    with pytest.raises(StageError, match=r"the robot itself allows less .* rad/s beyond its speed; nothing was moved"):
        rehearsed(swing(reach_rad=0.2))


def test_a_limited_command_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def limited(told: Exchange) -> Exchange:
        sent = dataclasses.replace(told.sent, position_rad=told.sent.position_rad - 0.01)
        return dataclasses.replace(told, sent=sent)

    spoil(monkeypatch, limited)
    made, _ = rehearsed(swing())
    assert any("sent up to 0.010 rad off its command" in one for one in made.warnings)


def test_the_check_names_every_limit_and_finds_the_shipped_posture_sound() -> None:
    checked = check_motion(ARM, GAME, swing(), SAFETY)
    kinds = {"speed", "acceleration", "effort", "stop", "gap", "table", "cup, x", "cup, y", "cup, z"}
    assert {one.what for one in checked} == kinds
    assert all(one.holds for one in checked)


def test_a_box_without_inside_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"'cup_low_m' is .* allowed: below 'cup_high_m'"):
        dataclasses.replace(SAFETY, cup_low_m=(1.0, 0.0, 0.0))
