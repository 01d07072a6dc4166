"""Playing a joint motion on a robot and keeping what its sensors tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot
from kendama_cli.errors import StageError
from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class JointRecording:
    """k control periods of n joints: time (k,), angles, speeds and efforts (k, n), wrist wrenches (k, 6)."""

    t_s: Array
    position_rad: Array
    velocity_rad_s: Array
    effort_nm: Array
    wrist_wrench: Array


def play(robot: Robot, motion: JointTrajectory, seed: int) -> JointRecording:
    """Play ``motion``, sampled at the control period of ``robot``, from rest at its first posture; return the
    recording.

    Raises StageError, before anything moves, where the robot has other joints, HardwareError of the line.
    """
    if motion.joint_names != robot.joint_names:
        raise StageError(
            f"the robot has the joints {', '.join(robot.joint_names)}, the configured arm "
            f"{', '.join(motion.joint_names)}: choose the robot's own description (robot=...); nothing was moved"
        )
    exchanges = [robot.reset(motion.position_rad[0], seed)]
    rows = zip(motion.position_rad[1:], motion.velocity_rad_s[1:], motion.acceleration_rad_s2[1:], strict=True)
    exchanges += [robot.exchange(JointCommand(*row)) for row in rows]
    return recorded(exchanges)


def recorded(exchanges: Sequence[Exchange]) -> JointRecording:
    """Return the sensors' readings in these control periods."""
    states = [exchange.state for exchange in exchanges]
    return JointRecording(
        np.array([exchange.t_s for exchange in exchanges]),
        np.array([state.position_rad for state in states]),
        np.array([state.velocity_rad_s for state in states]),
        np.array([state.effort_nm for state in states]),
        np.array([state.wrist_wrench for state in states]),
    )
