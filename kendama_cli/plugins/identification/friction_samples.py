"""Friction that a robot's controller does not know, from its sensors' readings."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.signal import savgol_filter

from kendama_cli.errors import HardwareError, StageError
from kendama_cli.plugins.identification.friction_choice import FrictionSamples, Mask
from kendama_cli.plugins.identification.recording import JointRecording
from kendama_cli.robot_model.friction import parametric_torque
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings

ORDER = 4
"""Order of the local polynomials; a lower one would flatten the accelerations."""
STUCK_RAD_S = 0.01
"""A joint slower than this may be sticking, or creeping as the readings' noise tells."""
SPENT = 0.97
WEIGHTLESS_KG = 1e-12
FEWEST = 200
"""Samples of a joint with which its friction can be told."""


class Samples:
    """Computes friction samples for one arm."""

    def __init__(self, robot: RobotSettings, game: GameSettings) -> None:
        self._laden = RobotModel(robot, game.cup, game.gravity_m_s2)
        # the wrist's sensor measures all that the tool exerts, so that it counts for nothing here
        weightless = dataclasses.replace(game.cup, mass_kg=WEIGHTLESS_KG)
        self._bare = RobotModel(robot, weightless, game.gravity_m_s2)

    def of(self, recording: JointRecording, smoothing_s: float) -> FrictionSamples:
        """Return the friction in every sample of ``recording`` that the settings do not withhold, from equation (2),

            xi = tau + J^T w - (H q'' + C q' + g),

        without the tool, w being the wrench that it exerts; a robot without a sensor at the wrist tells zeros, and the
        tool counts as part of the arm. All readings are smoothed alike by local polynomials. What efforts and wrenches
        come before or after the angles, be it half a step of a simulation, is found and taken out. A joint's samples
        count where it moves on throughout the window, for in a joint that sticks friction is anything, and where it is
        not at a limit of effort or speed.

        Raises HardwareError where the robot reports no efforts, StageError, naming the joint, where one hardly moves.
        """
        if not recording.effort_nm.any():
            raise HardwareError(
                "the robot reports no effort: every reading is 0 Nm, and friction is found from motor torques; "
                "allowed: a robot that measures them: leave the stage 'identify' out of the pipeline"
            )
        period_s = float(np.diff(recording.t_s).mean())
        window = max(2 * round(smoothing_s / period_s / 2) + 1, ORDER + 3)
        if len(recording.t_s) <= 2 * window:
            raise StageError(
                f"the recorded motion has {len(recording.t_s)} samples; needed: more than {2 * window}, two windows of "
                f"{smoothing_s} s: lower identify.smoothing_s"
            )

        def smooth(values: Array, derivative: int = 0) -> Array:
            made = savgol_filter(values, window, ORDER, deriv=derivative, delta=period_s, axis=0)
            return np.asarray(made)

        angles = recording.position_rad
        velocity = smooth(angles, 1)
        rigid, tool = self._torques(smooth(angles), velocity, smooth(angles, 2), smooth(recording.wrist_wrench))
        torque = smooth(recording.effort_nm) + tool - rigid - parametric_torque(self._laden.friction, velocity)
        kept = _moving_on(velocity, window) & ~_at_limits(self._laden, recording.effort_nm, velocity, window)
        kept[: window // 2] = kept[-(window // 2) :] = False  # the polynomials at the ends are one-sided
        self._require_motion(velocity, kept)
        change = np.gradient(rigid, period_s, axis=0)
        torque = torque - _ahead_s(velocity, torque, change, kept, self._laden.limits.effort_nm) * change
        return FrictionSamples(velocity, torque, kept)

    def _torques(
        self, position_rad: Array, velocity_rad_s: Array, acceleration_rad_s2: Array, wrench: Array
    ) -> tuple[Array, Array]:
        """Return the torque that the rigid bodies need, and that of the tool's wrench; (k, n) each."""
        arm = self._bare if wrench.any() else self._laden
        rigid, tool = np.empty_like(position_rad), np.empty_like(position_rad)
        for k, sample in enumerate(zip(position_rad, velocity_rad_s, acceleration_rad_s2, strict=True)):
            rigid[k] = arm.rigid_effort_nm(*sample)
            tool[k] = _tip_jacobian(arm, sample[0]).T @ wrench[k]
        return rigid, tool

    def _require_motion(self, velocity_rad_s: Array, kept: Mask) -> None:
        for j, name in enumerate(self._laden.joint_names):
            if kept[:, j].sum() < FEWEST:
                fastest = float(np.abs(velocity_rad_s[:, j]).max())
                raise StageError(
                    f"joint '{name}' moved too little to identify its friction: {int(kept[:, j].sum())} samples of "
                    f"steady direction, at most {fastest:.3g} rad/s; needed: {FEWEST}: raise identify.duration_s or "
                    "identify.amplitude_rad, or lower identify.smoothing_s"
                )


def _at_limits(arm: RobotModel, effort_nm: Array, velocity_rad_s: Array, window: int) -> Mask:
    """Return a mask (k, n) of samples with a motor at its limit of torque or velocity anywhere in the window around
    them.
    """
    spent = (np.abs(effort_nm) > SPENT * arm.limits.effort_nm) | (
        np.abs(velocity_rad_s) > SPENT * arm.limits.velocity_rad_s
    )
    return np.asarray(maximum_filter1d(spent, window, axis=0), dtype=bool)


def _ahead_s(velocity_rad_s: Array, torque_nm: Array, change_nm_s: Array, kept: Mask, effort_nm: Array) -> float:
    """Return the lead of the efforts over the angles [s]: least squares beside plain friction, over all joints at
    once.
    """
    along = square = 0.0
    for j, scale in enumerate(effort_nm):
        rows = kept[:, j]
        speed = velocity_rad_s[rows, j]
        plain = np.column_stack([np.sign(speed), speed, np.ones(len(speed))])
        both = np.column_stack([torque_nm[rows, j], change_nm_s[rows, j]]) / scale
        both -= plain @ np.linalg.lstsq(plain, both, rcond=None)[0]
        along += float(both[:, 0] @ both[:, 1])
        square += float(both[:, 1] @ both[:, 1])
    return along / max(square, 1e-300)


def _moving_on(velocity_rad_s: Array, window: int) -> Mask:
    """Return a mask (k, n) of samples whose joint moves in one direction over the whole window around them."""
    signs = np.where(np.abs(velocity_rad_s) > STUCK_RAD_S, np.sign(velocity_rad_s), 0.0)
    runs = np.cumsum(np.vstack([np.zeros((1, velocity_rad_s.shape[1])), signs]), axis=0)
    steady = np.zeros(velocity_rad_s.shape, dtype=bool)
    half = window // 2
    steady[half : len(velocity_rad_s) - half] = np.abs(runs[window:] - runs[:-window]) == window
    return steady


def _tip_jacobian(arm: RobotModel, position_rad: Array) -> Array:
    """Return the Jacobian (6, n) of the tip link's linear and angular velocity, in its own frame and at its origin."""
    body = arm.posed(position_rad)
    jacobian = body.skeleton.getJacobian(body.tip)
    return np.vstack([jacobian[3:], jacobian[:3]])
