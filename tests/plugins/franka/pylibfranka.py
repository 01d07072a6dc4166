"""Stands in for the library: an arm that obeys at once, refuses what a real one refuses, and needs no clock.

A test of the loop uses ``Arm`` itself; one of the process has it found in place of the library. A file ``fault`` beside
the working directory says what goes wrong.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

START = np.array([0.0, 0.0, 0.0, -1.57, 0.0, 1.57, 0.785])
REFUSED_RAD_S2, REFUSED_RAD_S3 = 10.0, 5000.0
CYCLE_S = 0.001


class FrankaException(RuntimeError):  # noqa: N818 (theirs)
    pass


class ControlException(RuntimeError):  # noqa: N818 (theirs)
    pass


class NetworkException(RuntimeError):  # noqa: N818 (theirs)
    pass


class RealtimeConfig:
    kEnforce, kIgnore = 0, 1  # noqa: N815 (theirs)


class ControllerMode:
    JointImpedance = 0


@dataclass
class JointPositions:
    q: list[float]
    motion_finished: bool = False


@dataclass
class Arm:
    """Goes where it is sent; in the cycles ``lost`` no answer comes in time, and it goes on as it went.

    After the cycles ``stale`` it tells what it was sent before the newest command, which it has all the same.
    """

    lost: frozenset[int] = frozenset()
    stale: frozenset[int] = frozenset()
    sent: list[np.ndarray] = field(default_factory=lambda: [START, START, START, START])
    finished: bool = False
    reflex: str | None = None
    cycle: int = 0
    since: int = 0

    def readOnce(self) -> tuple[Any, Any]:  # noqa: N802 (theirs)
        if self.reflex is not None:
            raise ControlException(
                f'libfranka: Move command aborted: motion aborted by reflex! ["{self.reflex}"]\ncontrol_command: 1.0'
            )
        since, self.since = self.since, 0
        return self.state(), SimpleNamespace(to_sec=lambda: since * CYCLE_S)

    def writeOnce(self, command: Any) -> None:  # noqa: N802 (theirs)
        self.cycle += 1
        self._go(np.array(command.q))
        if self.cycle in self.lost:  # as franka-sim 1.1.7: the command, then a step on with its acceleration
            self._go(2 * self.sent[-1] - self.sent[-2] + np.diff(self.sent[-3:], 2, axis=0)[0])
        self.finished = command.motion_finished

    def _go(self, place: np.ndarray) -> None:
        self.sent.append(place)
        self.since += 1
        change = np.diff(self.sent[-4:], 2, axis=0) / CYCLE_S**2
        if np.abs(change[-1]).max() > REFUSED_RAD_S2:
            self.reflex = "joint_motion_generator_velocity_discontinuity"
        elif np.abs(np.diff(change, axis=0)).max() / CYCLE_S > REFUSED_RAD_S3:
            self.reflex = "joint_motion_generator_acceleration_discontinuity"

    def state(self, mode: str = "Idle") -> Any:
        told = self.sent[:-1] if self.cycle in self.stale else self.sent
        places = np.array(told[-3:])
        speed = np.diff(places, axis=0) / CYCLE_S
        seven = [0.0] * 7
        return SimpleNamespace(
            q=list(places[-1]),
            q_d=list(places[-1]),
            dq=list(speed[-1]),
            dq_d=list(speed[-1]),
            ddq_d=list(np.diff(speed, axis=0)[0] / CYCLE_S),
            tau_J=[1.0] * 7,
            tau_ext_hat_filtered=[0.5] * 7,
            K_F_ext_hat_K=seven[:6],
            robot_mode=SimpleNamespace(name=mode),
            last_motion_errors='["cartesian_reflex"]' if mode == "Reflex" else "[]",
        )


class Robot:
    def __init__(self, host: str, realtime: int) -> None:
        self._arm, self._mode = Arm(), "Idle"
        fault = Path("fault")
        if fault.exists() and fault.read_text() == "away":
            raise NetworkException(f"libfranka: Connection to {host} refused\nreally")
        if fault.exists() and fault.read_text() == "reflex":
            self._mode = "Reflex"

    def set_collision_behavior(self, *thresholds: list[float]) -> None:
        assert [len(one) for one in thresholds] == [7, 7, 6, 6]

    def read_once(self) -> Any:
        return self._arm.state(self._mode)

    def automatic_error_recovery(self) -> None:
        self._mode = "Idle"
        self._arm.reflex = None

    def start_joint_position_control(self, mode: int) -> Arm:
        fault = Path("fault")
        if fault.exists() and fault.read_text() == "pushed":
            self._arm.reflex = "cartesian_reflex"
        return self._arm
