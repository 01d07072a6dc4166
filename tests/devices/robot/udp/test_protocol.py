"""Payloads: what is packed is unpacked, to the last bit, and nothing malformed is ever taken for one."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kendama_cli.devices.robot.interface import Exchange, JointCommand, RobotState, SceneState
from kendama_cli.devices.robot.udp import protocol
from kendama_cli.devices.robot.udp.protocol import DatagramError, Report, Welcome
from kendama_cli.robot_model.limits import JointLimits


def test_welcome_reports_joints_limits_and_timing() -> None:
    limits = JointLimits(*(np.arange(3.0) + k for k in range(5)))
    welcome = Welcome(("a", "b_2", "wrist-ü"), limits, 0.004, True, 0.2)
    told = protocol.unpack_welcome(protocol.pack_welcome(welcome))
    assert (told.joint_names, told.period_s, told.realtime, told.watchdog_s) == (
        welcome.joint_names,
        0.004,
        True,
        0.2,
    )
    for name in ("lower_rad", "upper_rad", "velocity_rad_s", "acceleration_rad_s2", "effort_nm"):
        assert np.array_equal(getattr(told.limits, name), getattr(limits, name))


SANE = Welcome(("a", "b"), JointLimits(*np.array([[-1.0, -2.0], *[[1.0, 2.0]] * 4])), 0.004, True, 0.2)
NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("spoiled", "says"),
    [
        *(({"period_s": value}, "a period of") for value in (NAN, INF, 0.0, -0.004, 1e-9, 1e9)),
        *(({"watchdog_s": value}, "a watchdog of") for value in (NAN, INF, 0.0, -1.0, 1e300)),
        *(({"joint_names": names}, "names the joints") for names in (("a", "a"), ("a", ""), ("\0", "b"))),
    ],
)
def test_a_welcome_whose_times_or_names_are_none_is_refused(spoiled: dict[str, float], says: str) -> None:
    assert protocol.unpack_welcome(protocol.pack_welcome(SANE)).joint_names == ("a", "b")
    with pytest.raises(DatagramError, match=f"the WELCOME (says )?{says}"):
        protocol.unpack_welcome(protocol.pack_welcome(dataclasses.replace(SANE, **spoiled)))  # type: ignore[arg-type]


@pytest.mark.parametrize("row", range(5))
@pytest.mark.parametrize("value", [NAN, INF, -INF, 1e30, -9.0, 9.0, 0.0])
def test_a_welcome_whose_limits_are_none_is_refused(row: int, value: float) -> None:
    whole = bytearray(protocol.pack_welcome(SANE))
    rows = np.frombuffer(whole, "<f8", offset=len(whole) - 80).reshape(5, 2)  # little-endian: a view to write to
    rows[row, 1] = value
    lower, upper = rows[0, 1], rows[1, 1]
    if np.abs(rows).max() <= 1e6 and lower < upper and (rows[2:] > 0).all():
        protocol.unpack_welcome(bytes(whole))
    else:
        with pytest.raises(
            DatagramError, match=r"WELCOME says of joint 'b': lower_rad .* allowed: finite, lower below"
        ):
            protocol.unpack_welcome(bytes(whole))


def test_a_welcome_of_no_joint_or_of_more_than_it_holds_is_refused() -> None:
    whole = bytearray(protocol.pack_welcome(SANE))
    for count, says in ((3, "malformed WELCOME"), (1, "malformed WELCOME"), (255, "malformed WELCOME")):
        whole[0] = count
        with pytest.raises(DatagramError, match=says):
            protocol.unpack_welcome(bytes(whole))
    with pytest.raises(DatagramError, match="names the joints"):
        protocol.unpack_welcome(bytes([0]) + bytes(whole[1:26]))
    with pytest.raises(DatagramError, match="real time 7"):
        protocol.unpack_welcome(bytes([2, 7]) + bytes(whole[2:]))


def test_counts_begin_anew_after_32_bits() -> None:
    zeros = np.zeros(2)
    state = RobotState(zeros, zeros, zeros, np.zeros(6), np.zeros(3), np.zeros(3), caught=False)
    report = Report(Exchange(JointCommand(zeros, zeros, zeros), state, 0.5), 2**40 + 5, 2**32)
    told = protocol.unpack_report(protocol.pack_report(report), 2)
    assert (told.missed, told.ignored) == (5, 0)


def test_a_joint_name_too_long_for_the_line_is_refused() -> None:
    limits = JointLimits(*(np.ones(1) for _ in range(5)))
    with pytest.raises(ValueError, match="longer than 48 bytes"):
        protocol.pack_welcome(Welcome(("x" * 49,), limits, 0.004, False, 1.0))


def test_command_reset_and_report_travel_to_the_last_bit() -> None:
    rng = np.random.default_rng(1)
    command = JointCommand(*rng.standard_normal((4, 7)))
    told = protocol.unpack_command(protocol.pack_command(command), 7)
    assert all(
        np.array_equal(getattr(told, n), getattr(command, n))
        for n in ("position_rad", "velocity_rad_s", "acceleration_rad_s2", "effort_nm")
    )
    position, seed = protocol.unpack_reset(protocol.pack_reset(command.position_rad, 2**64 - 1), 7)
    assert np.array_equal(position, command.position_rad)
    assert seed == 2**64 - 1
    wrench, places = rng.standard_normal(6), rng.standard_normal((2, 3))
    state = RobotState(*rng.standard_normal((3, 7)), wrench, *places, caught=True)
    report = protocol.unpack_report(protocol.pack_report(Report(Exchange(command, state, 1.25), 3)), 7)
    assert (report.missed, report.exchange.t_s, report.exchange.state.caught) == (3, 1.25, True)
    for name in ("position_rad", "velocity_rad_s", "effort_nm", "wrist_wrench", "cup_in_world_m", "ball_in_world_m"):
        assert np.array_equal(getattr(report.exchange.state, name), getattr(state, name))
    assert np.array_equal(report.exchange.sent.effort_nm, command.effort_nm)


def test_a_scene_travels_to_the_last_bit_and_a_robot_without_one_has_none() -> None:
    rng = np.random.default_rng(2)
    zeros = np.zeros(3)
    state = RobotState(zeros, zeros, zeros, np.zeros(6), zeros, zeros, caught=False)
    scene = SceneState(rng.standard_normal(3), rng.standard_normal(3), rng.standard_normal((3, 3)), rng.normal(size=3))
    exchange = Exchange(JointCommand(zeros, zeros, zeros), state, 0.5, scene)
    told = protocol.unpack_report(protocol.pack_report(Report(exchange, 0)), 3).exchange.scene
    assert told is not None
    for name in ("position_rad", "cup_m", "cup_rotation", "ball_m"):
        assert np.array_equal(getattr(told, name), getattr(scene, name))
    blind = dataclasses.replace(exchange, scene=None)
    assert protocol.unpack_report(protocol.pack_report(Report(blind, 0)), 3).exchange.scene is None


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_command_that_is_not_finite_is_refused(value: float) -> None:
    for row in range(4):
        bad = np.zeros((4, 2))
        bad[row, 1] = value
        with pytest.raises(DatagramError, match="COMMAND holds a value that is not finite"):
            protocol.unpack_command(protocol.pack_command(JointCommand(*bad)), 2)


@pytest.mark.parametrize("sensor", ["position_rad", "velocity_rad_s", "effort_nm", "wrist_wrench"])
def test_a_sensor_that_reads_no_number_is_refused(sensor: str) -> None:
    zeros = np.zeros(2)
    state = RobotState(zeros, zeros, zeros, np.zeros(6), np.zeros(3), np.zeros(3), caught=False)
    bad = dataclasses.replace(state, **{sensor: np.full_like(getattr(state, sensor), np.nan)})
    report = protocol.pack_report(Report(Exchange(JointCommand(zeros, zeros, zeros), bad, 0.0), 0))
    with pytest.raises(DatagramError, match="STATE holds a value that is not finite"):
        protocol.unpack_report(report, 2)


@pytest.mark.parametrize(
    "unpack",
    [
        lambda data: protocol.unpack_command(data, 2),
        lambda data: protocol.unpack_reset(data, 2),
        lambda data: protocol.unpack_report(data, 2),
        protocol.unpack_welcome,
    ],
)
@given(data=st.binary(max_size=47))
def test_a_payload_of_another_length_is_refused(unpack: object, data: bytes) -> None:
    assert callable(unpack)
    if len(data) == 24:  # the length of a RESET of two joints
        return
    with pytest.raises(DatagramError, match=r"malformed|the WELCOME says a period"):
        unpack(data)
