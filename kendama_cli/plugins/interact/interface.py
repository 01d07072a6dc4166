"""Interface of every task-space controller: the state of the arm that it is asked in, the torques that it returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class TaskState:
    """State of an arm of n joints for a task-space controller; velocities and forces are linear, then angular."""

    position_rad: Array
    """(n,)"""
    velocity_rad_s: Array
    """(n,)"""
    tool_m: Array
    """(3,) in the world"""
    tool_rotation: Array
    """(3, 3) from the tool to the world"""
    jacobian: Array
    """(6, n) of the tool, in the world"""
    jacobian_rate: Array
    """(6, n) J', its derivative in time"""
    inertia: Array
    """(n, n) H"""
    contact_n: Array
    """(3,) measured force that the tool exerts on what it touches, in the world"""


@dataclass(frozen=True)
class JointTorque:
    """Torque of the joints (n,) that a task-space controller commands, without weight, Coriolis and friction
    compensation.
    """

    torque_nm: Array
    velocity_rad_s: Array
    """qr', the joint speeds that the desired motion needs: those for which Coriolis and friction are compensated"""


@dataclass(frozen=True)
class TaskReference:
    """Reference of the tool now: pose, velocity and force."""

    position_m: Array
    """(3,) in the world"""
    rotation: Array
    """(3, 3)"""
    velocity: Array
    """(6,)"""
    acceleration: Array
    """(6,)"""
    force_n: Array
    """(3,) force that the tool shall exert on what it touches, in the world"""
    force_axis: Array
    """(3,) unit vector along which force, not position, is to be held; zero where there is none"""
    force_share: float
    """0..1: how far the springs along that axis have given way to the force"""


class TaskController(Protocol):
    """Controller from the tool's desired pose and force to torques; a call of ``command`` is one control period."""

    def reset(self, posture_rad: Array) -> None:
        """Forget what happened; ``posture_rad`` (n,) is kept to where the tool leaves the joints free."""

    def command(self, state: TaskState, reference: TaskReference, period_s: float) -> JointTorque:
        """Return the torques for the coming control period."""
