"""Torques that a task-space controller asks of an arm, and the state of the arm that it asks them for."""

from __future__ import annotations

from dataclasses import dataclass

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
