"""Datagrams between robot and commander: their kinds, and one fixed little-endian layout for each.

reference/protocol.md describes all of it for whoever writes the end of the robot. The commander sends HELLO, OPEN (see
seal.py), then RESET, COMMAND and HALT under counters that rise by one; the robot answers with WELCOME, STATE or STOPPED
under the same counter, or WORKING while a RESET is under way.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from kendama_cli.devices.robot.interface import Exchange, JointCommand, RobotState, SceneState
from kendama_cli.errors import HardwareError
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array

VERSION = 5
MAX_BYTES = 4096
"""No datagram of this protocol is longer."""
_WELCOME = struct.Struct("<BBddd")
"""The last double is spare: 0."""
NAME_BYTES = 48
_RESET = struct.Struct("<Q")
_STATE = struct.Struct("<dIIB")
_REASON_BYTES = 400
MAX_COUNT = 2**32 - 1
_MIN_S, _MAX_PERIOD_S, _MAX_WATCHDOG_S = 1e-4, 1.0, 3600.0
_MAX_LIMIT = 1e6
"""No limit of a joint is beyond this, in rad, rad/s, rad/s^2 or Nm."""
_LIMITS = ("lower_rad", "upper_rad", "velocity_rad_s", "acceleration_rad_s2", "effort_nm")


class Kind(IntEnum):
    """Kind of a datagram."""

    HELLO = 1
    CHALLENGE = 2
    OPEN = 3
    WELCOME = 4
    RESET = 5
    COMMAND = 6
    STATE = 7
    HALT = 8
    STOPPED = 9
    WORKING = 12


class DatagramError(HardwareError):
    """An authentic datagram whose content is not of this protocol."""


@dataclass(frozen=True)
class Datagram:
    """One message: its kind, its session (0: none), and its number in it."""

    kind: Kind
    session: int
    counter: int
    payload: bytes = b""


@dataclass(frozen=True)
class Welcome:
    """Robot's account of itself: joints, limits, control period, and how it keeps time.

    ``watchdog_s`` is the silence after which a moving robot stops and stays stopped.
    """

    joint_names: tuple[str, ...]
    limits: JointLimits
    period_s: float
    realtime: bool
    watchdog_s: float


@dataclass(frozen=True)
class Report:
    """One answered control period, with how many had no command in time so far, and how many datagrams were foreign."""

    exchange: Exchange
    missed: int
    ignored: int = 0


def pack_welcome(welcome: Welcome) -> bytes:
    """Pack the payload of WELCOME; raises ValueError for a joint name that does not fit."""
    n = len(welcome.joint_names)
    parts = [_WELCOME.pack(n, welcome.realtime, welcome.period_s, welcome.watchdog_s, 0.0)]
    for name in welcome.joint_names:
        encoded = name.encode()
        if len(encoded) > NAME_BYTES:
            raise ValueError(f"joint name '{name}' is longer than {NAME_BYTES} bytes")
        parts.append(encoded.ljust(NAME_BYTES, b"\0"))
    parts += [as_bytes(getattr(welcome.limits, name)) for name in _LIMITS]
    return b"".join(parts)


def unpack_welcome(payload: bytes) -> Welcome:
    """Unpack the robot's account of itself; raises DatagramError if the layout does not fit."""
    if len(payload) < _WELCOME.size:
        raise DatagramError(f"malformed WELCOME of {len(payload)} bytes")
    n, realtime, period_s, watchdog_s, _ = _WELCOME.unpack_from(payload)
    for name, value, least_s, most_s in (
        ("period", period_s, _MIN_S, _MAX_PERIOD_S),
        ("watchdog", watchdog_s, _MIN_S, _MAX_WATCHDOG_S),
    ):
        if not least_s <= value <= most_s:
            raise DatagramError(f"the WELCOME says a {name} of {value:g} s; allowed: {least_s:g} to {most_s:g}")
    if realtime > 1:
        raise DatagramError(f"the WELCOME says real time {realtime}; allowed: 0 and 1")
    expect("WELCOME", payload, _WELCOME.size + n * (NAME_BYTES + 8 * len(_LIMITS)))
    names = tuple(
        payload[_WELCOME.size + i * NAME_BYTES :][:NAME_BYTES].rstrip(b"\0").decode(errors="replace") for i in range(n)
    )
    if not all(names) or len(set(names)) != n or n == 0:
        raise DatagramError(f"the WELCOME names the joints {list(names)}; allowed: one name or more, each once")
    values = floats(payload, _WELCOME.size + n * NAME_BYTES).reshape(len(_LIMITS), n)
    _check_limits(names, values)
    limits = JointLimits(**dict(zip(_LIMITS, values, strict=True)))
    return Welcome(names, limits, period_s, bool(realtime), watchdog_s)


def _check_limits(names: tuple[str, ...], values: Array) -> None:
    """Raise DatagramError for limits (5, n) within which no joint can move, or that are none."""
    lower, upper = values[:2]
    wrong = ~(np.isfinite(values) & (np.abs(values) <= _MAX_LIMIT)).all(axis=0) | ~(lower < upper)
    wrong |= ~(values[2:] > 0).all(axis=0)
    if wrong.any():
        joint = int(wrong.argmax())
        said = ", ".join(f"{name} {value:g}" for name, value in zip(_LIMITS, values[:, joint], strict=True))
        raise DatagramError(
            f"the WELCOME says of joint '{names[joint]}': {said}; allowed: finite, lower below upper, the others "
            "above 0: mend the limits in the robot's controller"
        )


def pack_reset(position_rad: Array, seed: int) -> bytes:
    """Pack the payload of RESET: the joints' start positions, and the seed of a simulated robot's noise."""
    return _RESET.pack(seed) + as_bytes(position_rad)


def unpack_reset(payload: bytes, n: int) -> tuple[Array, int]:
    """Unpack joint positions (n,) and seed; raises DatagramError if the layout or a value does not fit."""
    expect("RESET", payload, _RESET.size + 8 * n)
    return finite("RESET", floats(payload, _RESET.size)), int(_RESET.unpack_from(payload)[0])


def pack_command(command: JointCommand) -> bytes:
    """Pack the payload of COMMAND."""
    return as_bytes(command.position_rad, command.velocity_rad_s, command.acceleration_rad_s2, command.effort_nm)


def unpack_command(payload: bytes, n: int) -> JointCommand:
    """Unpack the desired state of n joints; raises DatagramError if the layout or a value does not fit."""
    expect("COMMAND", payload, 32 * n)
    return JointCommand(*finite("COMMAND", floats(payload)).reshape(4, n))


def pack_report(report: Report) -> bytes:
    """Pack the payload of STATE."""
    sent, state = report.exchange.sent, report.exchange.state
    counts = report.missed & MAX_COUNT, report.ignored & MAX_COUNT  # of 32 bits: they begin anew at 0
    return _STATE.pack(report.exchange.t_s, *counts, state.caught) + as_bytes(
        sent.position_rad,
        sent.velocity_rad_s,
        sent.acceleration_rad_s2,
        sent.effort_nm,
        state.position_rad,
        state.velocity_rad_s,
        state.effort_nm,
        state.wrist_wrench,
        state.cup_in_world_m,
        state.ball_in_world_m,
        _scene_values(report.exchange.scene, len(state.position_rad)),
    )


def unpack_report(payload: bytes, n: int) -> Report:
    """Unpack the answered control period of n joints; raises DatagramError if the layout or a value does not fit."""
    expect("STATE", payload, _STATE.size + 8 * (8 * n + 27))
    t_s, missed, ignored, caught = _STATE.unpack_from(payload)
    values = floats(payload, _STATE.size)
    known = finite("STATE", np.append(values[: 7 * n + 6], t_s))
    sent = JointCommand(*known[: 4 * n].reshape(4, n))
    position, velocity, effort = known[4 * n : 7 * n].reshape(3, n)
    cup, ball = values[7 * n + 6 : 7 * n + 12].reshape(2, 3)
    state = RobotState(position, velocity, effort, known[7 * n : 7 * n + 6], cup, ball, bool(caught))
    return Report(Exchange(sent, state, t_s, _scene(values[7 * n + 12 :], n)), missed, ignored)


def pack_reason(reason: str) -> bytes:
    """Pack the payload of STOPPED: the reason why the robot stands still."""
    return reason.encode()[:_REASON_BYTES]


def unpack_reason(payload: bytes) -> str:
    """Unpack the reason why the robot stands still."""
    return payload.decode(errors="replace")


def _scene_values(scene: SceneState | None, n: int) -> Array:
    """Return the scene as (n + 15,) numbers; nan if the robot knows none."""
    if scene is None:
        return np.full(n + 15, np.nan)
    return np.concatenate([scene.position_rad, scene.cup_m, scene.cup_rotation.ravel(), scene.ball_m])


def _scene(values: Array, n: int) -> SceneState | None:
    if not np.isfinite(values).all():
        return None
    return SceneState(values[:n], values[n : n + 3], values[n + 3 : n + 12].reshape(3, 3), values[n + 12 :])


def as_bytes(*arrays: Array) -> bytes:
    """Join the arrays one after the other, little-endian doubles."""
    return np.concatenate(arrays).astype("<f8", copy=False).tobytes()


def floats(payload: bytes, offset: int = 0) -> Array:
    """Return the doubles from byte ``offset`` on."""
    return np.frombuffer(payload, "<f8", offset=offset).astype(np.float64, copy=False)


def finite(what: str, values: Array) -> Array:
    """Return ``values``; raises DatagramError if one is not finite."""
    if not np.isfinite(values).all():
        raise DatagramError(f"{what} holds a value that is not finite")
    return values


def expect(what: str, payload: bytes, size: int) -> None:
    """Raise DatagramError where ``payload`` has not ``size`` bytes."""
    if len(payload) != size:
        raise DatagramError(f"malformed {what}: {len(payload)} bytes of payload instead of {size}")
