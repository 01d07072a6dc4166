"""Torque commands and their answers as bytes: they come back exactly, and what is malformed is named."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kendama_cli.devices.robot.interface import BodyPose, ContactTruth, RobotState, TorqueExchange
from kendama_cli.devices.robot.udp.protocol import MAX_BYTES, DatagramError
from kendama_cli.devices.robot.udp.torque_protocol import (
    TorqueReport,
    pack_torque,
    pack_torque_report,
    unpack_torque,
    unpack_torque_report,
)
from kendama_cli.robot_model.joint_torque import JointTorque

NAMES = st.text(st.characters(codec="utf-8", exclude_characters="\0"), min_size=1, max_size=12)


def _report(rng: np.random.Generator, n: int, names: list[str], touched: str) -> TorqueReport:
    def draw(size: int) -> np.ndarray:
        return rng.normal(size=size)

    state = RobotState(draw(n), draw(n), draw(n), draw(6), draw(3), np.full(3, np.nan), False)
    bodies = tuple(BodyPose(name, draw(3), rng.normal(size=(3, 3))) for name in names)
    return TorqueReport(TorqueExchange(JointTorque(draw(n), draw(n)), state, 0.125, ContactTruth(touched, bodies)), 7)


@given(st.integers(0, 2**32), st.integers(1, 9), st.lists(NAMES, max_size=20, unique=True))
def test_a_report_comes_back_bit_for_bit_and_fits_a_datagram(seed: int, n: int, names: list[str]) -> None:
    report = _report(np.random.default_rng(seed), n, names, names[0] if names else "")
    packed = pack_torque_report(report)
    assert len(packed) < MAX_BYTES - 64
    back = unpack_torque_report(packed, n)
    assert pack_torque_report(back) == packed
    assert back.missed == 7
    assert back.exchange.truth is not None
    assert [one.name for one in back.exchange.truth.bodies] == names
    assert np.array_equal(back.exchange.state.wrist_wrench, report.exchange.state.wrist_wrench)


def test_a_command_comes_back_and_one_that_is_not_finite_is_refused() -> None:
    command = JointTorque(np.array([1.0, -2.0]), np.array([0.5, 0.25]))
    back = unpack_torque(pack_torque(command), 2)
    assert np.array_equal(back.torque_nm, command.torque_nm)
    assert np.array_equal(back.velocity_rad_s, command.velocity_rad_s)
    with pytest.raises(DatagramError, match="TORQUE holds a value that is not finite"):
        unpack_torque(pack_torque(JointTorque(np.array([np.nan, 0.0]), np.zeros(2))), 2)
    with pytest.raises(DatagramError, match="malformed TORQUE: 32 bytes of payload instead of 48"):
        unpack_torque(pack_torque(command), 3)


def test_a_scene_that_does_not_fit_is_named() -> None:
    rng = np.random.default_rng(1)
    with pytest.raises(DatagramError, match="a scene of 21 movable bodies; at most 20 fit a datagram"):
        pack_torque_report(_report(rng, 7, [f"b{i}" for i in range(21)], ""))
    with pytest.raises(DatagramError, match="is longer than 48 bytes"):
        pack_torque_report(_report(rng, 7, ["b" * 49], ""))
    with pytest.raises(DatagramError, match="malformed TORQUE_STATE of 3 bytes"):
        unpack_torque_report(b"abc", 7)
