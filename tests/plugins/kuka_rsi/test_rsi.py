"""RSI against a controller that obeys, errs and lies: every telegram is answered, or one clear line says why not."""

from __future__ import annotations

import dataclasses
import re
import socket
import time
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.errors import ConfigError, HardwareError, MissingPartError
from kendama_cli.motion import minimum_jerk
from kendama_cli.plugins.kuka_rsi.robot import RsiRobot, open_rsi
from kendama_cli.plugins.kuka_rsi.telegram import TelegramError, read_telegram, write_answer
from kendama_cli.plugins.suites.robot import CHECKS
from tests.plugins.kuka_rsi.six_axes import GAME, LOOPBACK, RSI, Said, controller, free_port, six_axes

STILL = JointCommand(np.zeros(6), np.zeros(6), np.zeros(6))


def swing(robot: RsiRobot, reach_rad: float = 0.3, span_s: float = 0.5) -> list[float]:
    """A minimum-jerk motion of all axes; how far each reading is behind what was sent the period before [rad].

    Without the periods in which an answer came too late, or had when the controller counted: a busy machine's.
    """
    behind, late = [], [robot.late]
    for t_s in np.arange(robot.period_s, span_s, robot.period_s):
        rate = float(minimum_jerk.step_rate(t_s / span_s)) / span_s
        place = np.full(6, reach_rad * float(minimum_jerk.step(t_s / span_s)))
        done = robot.exchange(JointCommand(place, np.full(6, reach_rad * rate), np.zeros(6)))
        behind.append(float(np.abs(done.sent.position_rad - done.state.position_rad).max()))
        late.append(robot.late)
    return [one for k, one in enumerate(behind[:-2]) if late[k + 3] == late[k]]


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_rsi_keeps_the_laws_of_a_robot(check, tmp_path: Path) -> None:
    port = free_port()
    settings, arm = dataclasses.replace(RSI, port=port, approach_rad_s=2.0), six_axes(tmp_path)
    with controller(port):
        check(lambda: open_robot(settings, arm, GAME))


def test_a_motion_is_carried_out_and_every_ipoc_is_kept(tmp_path: Path) -> None:
    port = free_port()
    with controller(port) as kuka, open_rsi(dataclasses.replace(RSI, port=port), six_axes(tmp_path), GAME) as robot:
        robot.reset(np.zeros(6), 0)
        behind = np.array(swing(robot))
        assert len(behind) > 0
        assert behind.max() < 1e-6  # the wire's last digit
        assert robot.late <= kuka.wrong
    asked = [ipoc for ipoc, _ in kuka.answers]
    assert asked == sorted(set(asked)), "every telegram is answered once"
    places = np.radians([place for _, place in kuka.answers])
    steps = np.abs(np.diff(places, axis=0)) / RSI.control_period_s
    assert steps.max() <= 3.0 * (1 + 1e-4)


def test_a_time_stamp_that_begins_anew_after_32_bits_is_the_next_one(tmp_path: Path) -> None:
    port, first = free_port(), 2**32 - 1500
    settings, times = dataclasses.replace(RSI, port=port), []
    with controller(port, first_ipoc=first) as kuka, open_rsi(settings, six_axes(tmp_path), GAME) as robot:
        while len(times) < 2000 and not (kuka.answers and kuka.answers[-1][0] < 100):
            times.append(robot.exchange(STILL).t_s)
        assert robot.late <= kuka.wrong
    asked = [ipoc for ipoc, _ in kuka.answers]
    assert max(asked) > first
    assert asked[-1] < 1000
    assert times == sorted(times)
    assert times[-1] < 60.0


def test_signs_and_offsets_are_the_controllers(tmp_path: Path) -> None:
    port = free_port()
    settings = dataclasses.replace(
        RSI, port=port, signs=(-1, 1, 1, 1, 1, 1), offset_deg=(0.0, -90.0, 90.0, 0.0, 0.0, 0.0)
    )
    with controller(port) as kuka, open_rsi(settings, six_axes(tmp_path), GAME) as robot:
        start = robot.reset(np.radians([0.0, 90.0, -90.0, 0.0, 0.0, 0.0]), 0)
        assert np.allclose(start.state.position_rad, np.radians([0, 90, -90, 0, 0, 0]), atol=1e-6)
        assert np.allclose(kuka.answers[-1][1], 0.0, atol=1e-6)
        done = robot.reset(start.state.position_rad + 0.01, 0)
        assert np.allclose(done.state.position_rad - start.state.position_rad, 0.01, atol=1e-6)
        assert np.allclose(kuka.answers[-1][1], np.degrees([-0.01, 0.01, 0.01, 0.01, 0.01, 0.01]), atol=1e-6)


def test_a_commander_that_is_late_brakes_within_the_limits_and_is_counted(tmp_path: Path) -> None:
    port = free_port()
    with controller(port) as kuka, open_rsi(dataclasses.replace(RSI, port=port), six_axes(tmp_path), GAME) as robot:
        robot.reset(np.zeros(6), 0)
        speed = np.full(6, 0.5)
        for k in range(1, 40):
            robot.exchange(JointCommand(0.002 * k * np.ones(6), speed, np.zeros(6)))
        before, count = robot.missed, len(kuka.answers)
        while len(kuka.answers) < count + 60:
            time.sleep(0.01)
        held = robot.exchange(JointCommand(np.full(6, 0.1), np.zeros(6), np.zeros(6)))
        assert robot.missed - before >= 30
        assert held.t_s == pytest.approx((40 + robot.missed) * robot.period_s)
        limits = np.degrees(robot.limits.acceleration_rad_s2.max())
        places = np.array([place for _, place in kuka.answers[count - 5 : count + 60]])
        change = np.abs(np.diff(places, 2, axis=0)) / robot.period_s**2
        assert change.max() <= limits * 1.05
        assert np.ptp(places[-10:], axis=0).max() < 1e-6, "it stands"


def play_for_long(robot: RsiRobot) -> None:
    robot.reset(np.zeros(6), 0)
    swing(robot, span_s=5.0)


def spoiled(at: int, pattern: str, new: str) -> Said:
    return lambda number, true: re.sub(pattern, new, true) if number == at else true


def silent(number: int, true: str) -> str | None:
    return true if number < 150 else None


def anew(number: int, true: str) -> str:
    if number < 150:
        return true
    return re.sub(r"(?<=<IPOC>)\d+", lambda stamp: str(int(stamp.group()) + 1000), true)


@pytest.mark.parametrize(
    ("said", "says"),
    [
        (spoiled(150, r"<IPOC>\d+", "<IPOC>77"), r"IPOC 77 came after \d+, which no clock of its cycle says"),
        (spoiled(150, r"<IPOC>(\d+)", r"<IPOC>\g<1>1"), r"IPOC \d+ came after \d+, which no clock of its cycle says"),
        (spoiled(150, r"<IPOC>\d+", "<IPOC>soon"), "has a value that is none: invalid literal"),
        (spoiled(150, r'A2="[^"]*"', 'A2="nan"'), r"the controller says that its axes are at \[.*nan"),
        (spoiled(150, r'A2="[^"]*"', 'A2="40.0"'), r"axis A2 is said to have jumped by \d+\.\d+ deg in 4 ms"),
        (spoiled(150, r"<AIPos[^>]*>", ""), r"have no <AIPos>: load examples/rsi/kendama_rsi\.xml"),
        (spoiled(150, r"</Rob>", ""), "a telegram came that is no XML"),
        (silent, r"no telegram came for 0\.5 s"),
        (anew, "RSI ended and began anew, from where is not known"),
    ],
    ids=["clock_back", "clock_between", "no_number", "nan", "jump", "no_place", "cut", "silence", "anew"],
)
def test_a_controller_that_lies_or_falls_silent_is_one_clear_line(said: Said, says: str, tmp_path: Path) -> None:
    port = free_port()
    with (
        controller(port, said) as kuka,
        open_rsi(dataclasses.replace(RSI, port=port), six_axes(tmp_path), GAME) as robot,
    ):
        with pytest.raises(HardwareError, match=says) as caught:
            play_for_long(robot)
        assert "\n" not in str(caught.value)
        assert "it gets no more answers and stops the arm" in str(caught.value)
        time.sleep(0.1)
        count = len(kuka.answers)
        time.sleep(0.1)
        assert len(kuka.answers) == count, "the controller's own timeout stops the arm"
        with pytest.raises(HardwareError, match=says):
            robot.exchange(STILL)


def test_a_correction_beyond_what_is_allowed_halts(tmp_path: Path) -> None:
    port = free_port()
    settings = dataclasses.replace(RSI, port=port, max_correction_deg=5.0)
    with controller(port) as kuka, open_rsi(settings, six_axes(tmp_path), GAME) as robot:
        robot.reset(np.zeros(6), 0)
        with pytest.raises(HardwareError, match=r"axis A1 would be 5\.7 deg from where RSI began; allowed: 5"):
            robot.exchange(JointCommand(np.full(6, 0.1), np.zeros(6), np.zeros(6)))
        with pytest.raises(HardwareError, match="halted"):
            robot.exchange(STILL)
    assert np.abs([place for _, place in kuka.answers]).max() < 5.0


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_an_absurd_command_halts(value: float, tmp_path: Path) -> None:
    port = free_port()
    with controller(port) as kuka, open_rsi(dataclasses.replace(RSI, port=port), six_axes(tmp_path), GAME) as robot:
        robot.reset(np.zeros(6), 0)
        with pytest.raises(HardwareError, match=r"allowed: 6 finite numbers of at most .*: the robot halts"):
            robot.exchange(JointCommand(np.full(6, value), np.zeros(6), np.zeros(6)))
    assert not np.any([place for _, place in kuka.answers])


def test_the_cycle_must_be_the_controllers(tmp_path: Path) -> None:
    port = free_port()
    with (
        controller(port, cycle_ms=12),
        pytest.raises(HardwareError, match=r"the controller's cycle is 12 ms .*set hardware\.control_period_s=0\.012"),
        open_rsi(dataclasses.replace(RSI, port=port), six_axes(tmp_path), GAME),
    ):
        pass


def test_what_an_earlier_commander_left_corrected_does_not_jump_back(tmp_path: Path) -> None:
    port = free_port()
    settings, arm = dataclasses.replace(RSI, port=port, approach_rad_s=2.0), six_axes(tmp_path)
    with controller(port, patience_s=0.03) as kuka:  # so that it goes on sending while the next one opens
        with open_rsi(settings, arm, GAME) as robot:
            robot.reset(np.full(6, 0.3), 0)
        with open_rsi(settings, arm, GAME) as robot:
            assert np.allclose(robot.reset(np.full(6, 0.2), 0).state.position_rad, 0.2, atol=1e-6)
    steps = np.abs(np.diff(np.radians(kuka.places), axis=0)) / RSI.control_period_s
    assert steps.max() <= 3.0 * (1 + 1e-4)
    assert np.allclose(np.radians(kuka.places[-1]), 0.2, atol=1e-6)


def test_an_rsi_that_ran_before_and_does_not_end_is_not_corrected(tmp_path: Path) -> None:
    port = free_port()
    settings = dataclasses.replace(RSI, port=port)
    with controller(port, ends=False) as kuka:
        kuka.begun.wait()
        with pytest.raises(HardwareError, match=r"was running before .* end it, run"):
            open_rsi(settings, six_axes(tmp_path), GAME).__enter__()
    assert not kuka.answers


def test_a_controller_that_does_not_send_says_what_to_do(tmp_path: Path) -> None:
    settings = dataclasses.replace(RSI, port=free_port(), wait_s=0.2)
    with pytest.raises(MissingPartError, match=r"no RSI telegram of .* start the RSI program"):
        open_rsi(settings, six_axes(tmp_path), GAME).__enter__()


def test_what_others_send_is_counted_and_ignored(tmp_path: Path) -> None:
    port = free_port()
    with controller(port), open_rsi(dataclasses.replace(RSI, port=port), six_axes(tmp_path), GAME) as robot:
        robot.reset(np.zeros(6), 0)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as foreign:
            foreign.bind(("127.0.0.2", 0))
            for _ in range(50):
                foreign.sendto(b"<Rob><IPOC>0</IPOC></Rob>", (LOOPBACK, port))
            swing(robot)
        assert robot._link.foreign == 50


def test_seven_joints_are_refused(tmp_path: Path) -> None:
    arm = dataclasses.replace(six_axes(tmp_path), locked_joints=("a6",))
    with pytest.raises(ConfigError, match=r"'hardware\.kind' is 'rsi', which moves 6 axes; six has 5"):
        open_rsi(RSI, arm, GAME).__enter__()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"signs": (1, 1)}, "'signs' has 2 values; allowed: 6"),
        ({"offset_deg": (0.0,) * 7}, "'offset_deg' has 7 values; allowed: 6"),
        ({"reply_s": 0.004}, "'reply_s' is 0.004; allowed: less than the control period"),
    ],
)
def test_wrong_settings_are_one_clear_line(change: dict[str, object], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        dataclasses.replace(RSI, **change)  # type: ignore[arg-type]


@pytest.mark.parametrize("data", [b"", b"<Rob", b"<!DOCTYPE a><Rob/>", b"<Rob/>", b"\xff\xfe", b"<Rob>" + bytes(9000)])
def test_what_is_no_telegram_is_refused(data: bytes) -> None:
    with pytest.raises(TelegramError):
        read_telegram(data)


def test_an_answer_echoes_the_time_stamp_as_it_came() -> None:
    answer = write_answer("kendama", np.array([0.0, -1.5, 0.25, 0.0, 0.0, 1e-7]), 4208163634)
    assert answer.startswith(b'<Sen Type="kendama"><AKorr A1="0.0000000" A2="-1.5000000"')
    assert b"<IPOC>4208163634</IPOC>" in answer
