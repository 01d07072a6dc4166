"""The payloads of torque commands and their answers (see protocol.py)."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from kendama_cli.devices.robot.interface import BodyPose, ContactTruth, RobotState, TorqueExchange
from kendama_cli.devices.robot.udp.protocol import (
    MAX_COUNT,
    NAME_BYTES,
    DatagramError,
    as_bytes,
    expect,
    finite,
    floats,
)
from kendama_cli.robot_model.joint_torque import JointTorque

_STATE = struct.Struct(f"<dIIBBB{NAME_BYTES}s")
_MAX_BODIES = 20
"""So many movable bodies fit into one datagram beside the joints of any arm."""


@dataclass(frozen=True)
class TorqueReport:
    """One answered period of torque control; ``missed`` and ``ignored`` as in Report."""

    exchange: TorqueExchange
    missed: int
    ignored: int = 0


def pack_torque(command: JointTorque) -> bytes:
    """Pack the payload of TORQUE."""
    return as_bytes(command.torque_nm, command.velocity_rad_s)


def unpack_torque(payload: bytes, n: int) -> JointTorque:
    """Unpack the desired torque of n joints; raises DatagramError if the layout or a value does not fit."""
    expect("TORQUE", payload, 16 * n)
    return JointTorque(*finite("TORQUE", floats(payload)).reshape(2, n))


def pack_torque_report(report: TorqueReport) -> bytes:
    """Pack the payload of TORQUE_STATE; raises DatagramError if the scene does not fit into it."""
    exchange, state = report.exchange, report.exchange.state
    truth = exchange.truth or ContactTruth("", ())
    if len(truth.bodies) > _MAX_BODIES:
        raise DatagramError(f"a scene of {len(truth.bodies)} movable bodies; at most {_MAX_BODIES} fit a datagram")
    counts = report.missed & MAX_COUNT, report.ignored & MAX_COUNT
    scene = exchange.truth is not None, len(truth.bodies), _name(truth.touched)
    head = _STATE.pack(exchange.t_s, *counts, state.caught, *scene)
    poses = [as_bytes(one.position_m, one.rotation.ravel()) for one in truth.bodies]
    joints = as_bytes(
        exchange.sent.torque_nm,
        exchange.sent.velocity_rad_s,
        state.position_rad,
        state.velocity_rad_s,
        state.effort_nm,
        state.wrist_wrench,
        state.cup_in_world_m,
        state.ball_in_world_m,
    )
    return b"".join([head, *(_name(one.name) for one in truth.bodies), joints, *poses])


def unpack_torque_report(payload: bytes, n: int) -> TorqueReport:
    """Unpack the answered period of n joints; raises DatagramError if the layout or a value does not fit."""
    if len(payload) < _STATE.size:
        raise DatagramError(f"malformed TORQUE_STATE of {len(payload)} bytes")
    t_s, missed, ignored, caught, truthful, bodies, touched = _STATE.unpack_from(payload)
    names_end = _STATE.size + NAME_BYTES * bodies
    expect("TORQUE_STATE", payload, names_end + 8 * (5 * n + 12 + 12 * bodies))
    values = floats(payload, names_end)
    finite("TORQUE_STATE", np.append(values[: 5 * n + 6], t_s))
    torque, speed, position, velocity, effort = values[: 5 * n].reshape(5, n)
    wrench, cup, ball = values[5 * n : 5 * n + 12].reshape(2, 6)[0], *values[5 * n + 6 : 5 * n + 12].reshape(2, 3)
    state = RobotState(position, velocity, effort, wrench, cup, ball, bool(caught))
    poses = values[5 * n + 12 :].reshape(bodies, 12)
    names = [_text(payload[_STATE.size + NAME_BYTES * i :][:NAME_BYTES]) for i in range(bodies)]
    placed = tuple(BodyPose(name, pose[:3], pose[3:].reshape(3, 3)) for name, pose in zip(names, poses, strict=True))
    truth = ContactTruth(_text(touched), placed) if truthful else None
    return TorqueReport(TorqueExchange(JointTorque(torque, speed), state, t_s, truth), missed, ignored)


def _name(text: str) -> bytes:
    encoded = text.encode()
    if len(encoded) > NAME_BYTES:
        raise DatagramError(f"the name '{text}' of a body is longer than {NAME_BYTES} bytes")
    return encoded.ljust(NAME_BYTES, b"\0")


def _text(data: bytes) -> str:
    return data.rstrip(b"\0").decode(errors="replace")
