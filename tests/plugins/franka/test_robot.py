"""The arm behind its process, with a library that stands in: a fault is one clear line, recovery is explicit."""

from __future__ import annotations

import dataclasses
import importlib.util
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.devices.robot.interface import JointCommand, RecoverableRobot
from kendama_cli.errors import ConfigError, HardwareError, MissingPartError
from kendama_cli.plugins.franka.process import failure
from kendama_cli.plugins.franka.robot import open_franka
from tests.plugins.franka.arm import FR3, FRANKA, GAME, HERE
from tests.plugins.franka.pylibfranka import START
from tests.plugins.kuka_rsi.six_axes import six_axes

STILL = JointCommand(START, np.zeros(7), np.zeros(7))


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Has the process find the library that stands in; the folder of its faults."""
    only = tmp_path / "library"
    only.mkdir()
    (only / "pylibfranka.py").write_text((HERE / "pylibfranka.py").read_text())
    monkeypatch.setenv("PYTHONPATH", str(only))
    monkeypatch.syspath_prepend(str(only))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_command_is_carried_out_and_what_the_arm_feels_is_told(library: Path) -> None:
    with open_franka(FRANKA, FR3, GAME) as robot:
        assert isinstance(robot, RecoverableRobot)
        assert (robot.limits.acceleration_rad_s2 <= 9.0).all()
        told = robot.exchange(STILL)
        assert np.array_equal(told.sent.position_rad, START)
        assert np.array_equal(told.state.effort_nm, np.ones(7))
        assert np.array_equal(told.state.external_nm, np.full(7, 0.5))
        goal = START + 0.05
        there = robot.reset(goal, 0)
        assert there.t_s == 0.0
        assert np.allclose(there.state.position_rad, goal, atol=1e-5)  # as it was a millisecond before


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ("pushed", r"a reflex stopped it \(cartesian_reflex\); look why, then 'kendama robot recover hardware=franka"),
        ("reflex", r"a reflex stopped it \(cartesian_reflex\)"),
    ],
)
def test_a_reflex_is_one_clear_line_and_stays(library: Path, fault: str, says: str) -> None:
    (library / "fault").write_text(fault)
    with open_franka(FRANKA, FR3, GAME) as robot:
        for _ in range(2):
            with pytest.raises(HardwareError, match=says) as caught:
                robot.exchange(STILL)
            assert "\n" not in str(caught.value)


def test_an_arm_in_reflex_recovers_when_it_is_told_to(library: Path) -> None:
    (library / "fault").write_text("reflex")
    with open_franka(FRANKA, FR3, GAME) as robot:
        robot.recover()
        assert np.array_equal(robot.exchange(STILL).sent.position_rad, START)


def test_an_arm_that_is_not_there_is_one_clear_line(library: Path) -> None:
    (library / "fault").write_text("away")
    with pytest.raises(
        HardwareError, match=r"the arm at 127\.0\.0\.1: Connection to 127\.0\.0\.1 refused really; look"
    ):
        open_franka(FRANKA, FR3, GAME).__enter__()


def test_a_command_too_far_away_halts(library: Path) -> None:
    with open_franka(FRANKA, FR3, GAME) as robot:
        far = JointCommand(START + 0.5, np.zeros(7), np.zeros(7))
        with pytest.raises(
            HardwareError, match=r"joint 'joint\d' is commanded 0\.500 rad from where .*the arm was halted"
        ):
            robot.exchange(far)
        with pytest.raises(HardwareError, match="halted"):
            robot.exchange(STILL)


def test_a_process_that_ends_is_one_clear_line(library: Path) -> None:
    with open_franka(FRANKA, FR3, GAME) as robot:
        robot._pipe.process.kill()
        robot._pipe.process.wait()
        with pytest.raises(HardwareError, match="the process that moves the arm ended with -9"):
            robot.exchange(STILL)


def test_without_the_library_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MissingPartError, match=r"hardware=franka needs pylibfranka: pip install '\.\[franka\]'"):
        open_franka(FRANKA, FR3, GAME).__enter__()


def test_what_the_library_tells_in_lines_becomes_one() -> None:
    told = 'libfranka: Move command aborted: motion aborted by reflex! ["a_b", "c_d"]\nrate: 0.98 packets lost: 2'
    assert failure("x", told).startswith("the arm at x: a reflex stopped it (a_b, c_d); look why, then")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"jerk_rad_s3": (1.0,)}, "'jerk_rad_s3' has 1 values; allowed: 7, one for each joint"),
        ({"control_period_s": 0.0015}, "'control_period_s' is 0.0015; allowed: whole milliseconds"),
        ({"reply_s": 0.001, "realtime": "enforce"}, "'reply_s' is 0.001; allowed: less than the arm's cycle"),
    ],
)
def test_wrong_settings_are_one_clear_line(change: dict[str, object], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        dataclasses.replace(FRANKA, **change)  # type: ignore[arg-type]


def test_six_joints_are_refused(library: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'hardware\.kind' is 'franka', which moves 7 joints; six has 6"):
        open_franka(FRANKA, six_axes(tmp_path), GAME).__enter__()
