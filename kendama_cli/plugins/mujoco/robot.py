"""An arm in MuJoCo behind the robot's interface: commanded by plain positions, as an owner's controller does."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from kendama_cli.devices.robot.interface import Exchange, JointCommand, RobotState, SceneState
from kendama_cli.devices.robot.limiter import ABSURD_RAD, check_command, check_values, nearest_command
from kendama_cli.errors import HardwareError, SimulationError
from kendama_cli.physics.rim_crossing import is_inside
from kendama_cli.physics.rope import RopeLaw, rope_pull
from kendama_cli.physics.taut_rope import stretch_m
from kendama_cli.plugins.mujoco.arm import MujocoArm, build_arm
from kendama_cli.plugins.mujoco.library import mujoco
from kendama_cli.plugins.mujoco.settings import MujocoHardware
from kendama_cli.plugins.mujoco.urdf import joint_range
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings, SideTie
from kendama_cli.settings.robot import RobotSettings

STILL_RAD_S = 1e-4
"""An arm whose joints are all slower is at rest."""
MAX_SAG_RAD = 0.2
"""A joint that rests farther from its command is not held."""


class MujocoRobot:
    """A robot (see devices.robot.interface) whose own actuators follow the commanded positions; it takes no torque.

    ``exchange`` holds the command's position, after the limits, for ``control_period_s``. The rope pulls by the law of
    equations.md eq. 1 at both its ends. A reset lets the arm come to rest with the ball held below the cup.
    """

    realtime = False

    def __init__(self, robot: RobotSettings, game: GameSettings, hardware: MujocoHardware) -> None:
        arm = RobotModel(robot, game.cup, game.gravity_m_s2)
        self.arm = build_arm(hardware.model, robot, game, arm, hardware.timestep_s)
        self.joint_names = arm.joint_names
        self.limits = _command_limits(arm.limits, self.arm, hardware.control_period_s)
        self._steps = round(hardware.control_period_s / hardware.timestep_s)
        self.period_s = hardware.control_period_s
        self.missed = 0
        self._halted = False
        self._hardware = hardware
        self._world = MujocoWorld(self.arm, game, hardware)
        self.reset(arm.home_rad, 0)

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Rest where the servos hold the arm at ``position_rad`` (n,), the ball hanging still, time 0.

        Noise of readings is sampled from ``seed``. Raises HardwareError where the arm does not come to rest.
        """
        self._refuse_when_halted()
        rest = np.zeros(len(self.joint_names))
        try:
            check_values("position_rad", position_rad, np.full_like(rest, ABSURD_RAD))
        except HardwareError:
            self.halt()
            raise
        start = np.clip(position_rad, self.limits.lower_rad, self.limits.upper_rad)
        self._rng = np.random.default_rng(seed)
        self._periods = 0
        self._last = JointCommand(start, rest, rest)
        self._world.rest(start, self._hardware.settle_s)
        return Exchange(self._last, self._state(), 0.0, self._world.scene())

    def exchange(self, command: JointCommand) -> Exchange:
        """Carry out one control period; raises HardwareError after ``halt`` or for a command that it refuses."""
        self._refuse_when_halted()
        try:
            check_command(command, self.limits)
        except HardwareError:
            self.halt()
            raise
        sent = nearest_command(self._last, command, self.limits, self.period_s)
        self._last = sent = dataclasses.replace(sent, effort_nm=np.zeros(len(self.joint_names)))
        self._world.command(sent.position_rad)
        for _ in range(self._steps):
            self._world.step()
        self._periods += 1
        return Exchange(sent, self._state(), self._periods * self.period_s, self._world.scene())

    def halt(self) -> None:
        """Stop and stay stopped."""
        self._halted = True

    def close(self) -> None:
        """Halt; there is no device to let go of."""
        self.halt()

    def _refuse_when_halted(self) -> None:
        if self._halted:
            raise HardwareError("the arm in MuJoCo is halted and stays so: open it anew")

    def _state(self) -> RobotState:
        """Return the true state with noise on the joints and on the tracked cup and ball."""
        state, hardware = self._world.state(), self._hardware
        joints, tracked = hardware.joint_noise_rad, hardware.ball_noise_m
        return dataclasses.replace(
            state,
            position_rad=state.position_rad + self._rng.normal(0.0, joints, len(self.joint_names)),
            cup_in_world_m=state.cup_in_world_m + self._rng.normal(0.0, tracked, 3),
            ball_in_world_m=state.ball_in_world_m + self._rng.normal(0.0, tracked, 3),
        )


def _command_limits(limits: JointLimits, arm: MujocoArm, period_s: float) -> JointLimits:
    """Return ``limits`` of what the servos take: the angles that joints and actuators reach, where these are less.

    The speed of a command may turn about within a period. An acceleration is a limit of the joint: a command that leads
    a servo of lag T accelerates by T q''' more than the joint does, and MJCF limits neither.
    """
    lower, upper = np.array([joint_range(arm.model, joint) for joint in arm.joints.joint.tolist()]).T
    return dataclasses.replace(
        limits,
        lower_rad=np.maximum(limits.lower_rad, lower),
        upper_rad=np.minimum(limits.upper_rad, upper),
        acceleration_rad_s2=2.0 * limits.velocity_rad_s / period_s,
    )


class MujocoWorld:
    """The state of arm, cup, rope and ball, step by step."""

    def __init__(self, arm: MujocoArm, game: GameSettings, hardware: MujocoHardware) -> None:
        mj, model = mujoco(), arm.model
        self._arm, self._game, self._model = arm, game, model
        self._data = mj.MjData(model)
        self._law = RopeLaw.of(game, hardware.rope_scale)
        self._drag = tuple(hardware.drag_scale * one for one in game.drag)
        joint = int(model.body_jntadr[arm.ball])
        first, moves = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        self._ball, self._ball_pose = self._data.qpos[first : first + 3], self._data.qpos[first : first + 7]
        self._ball_rate = self._data.qvel[moves : moves + 6]
        self._cup_rate = np.zeros(6)
        side = game.cup.tie_m if isinstance(game.cup.tie, SideTie) else (1.0, 0.0, 0.0)
        self._side = np.array([side[0], side[1], 0.0]) / math.hypot(side[0], side[1])

    def rest(self, position_rad: Array, at_most_s: float) -> None:
        """Let the arm come to rest under ``position_rad`` (n,), the ball held below the cup, then let it hang.

        Raises HardwareError where it moves still after ``at_most_s``, or rests elsewhere.
        """
        mj, data, joints = mujoco(), self._data, self._arm.joints
        mj.mj_resetData(self._model, data)
        data.qpos[joints.position] = position_rad
        self.command(position_rad)
        for actuator in joints.actuator.tolist():  # a filter begins where its command is
            if (first := int(self._model.actuator_actadr[actuator])) >= 0:
                data.act[first] = data.ctrl[actuator]
        mj.mj_forward(self._model, data)
        for number in range(round(at_most_s / self._model.opt.timestep)):
            self._hang()
            self.step()
            if number > 10 and np.abs(data.qvel[joints.velocity]).max() < STILL_RAD_S:
                break
        else:
            fastest = float(np.abs(data.qvel[joints.velocity]).max())
            raise HardwareError(
                f"the arm in MuJoCo still moves by {fastest:.2g} rad/s {at_most_s:g} s after a reset: its servos do "
                "not hold it there, or need a higher hardware.settle_s"
            )
        away_rad = np.abs(data.qpos[joints.position] - position_rad)
        worst = int(away_rad.argmax())
        if away_rad[worst] > MAX_SAG_RAD:
            name = self._model.joint(int(joints.joint[worst])).name
            raise HardwareError(
                f"the arm in MuJoCo does not hold its start: joint '{name}' rests {away_rad[worst]:.2g} rad from it; "
                f"allowed: {MAX_SAG_RAD:g}; its servo is too weak for this posture with the cup"
            )
        self._hang()
        mj.mj_forward(self._model, data)

    def command(self, position_rad: Array) -> None:
        """Give the servos ``position_rad`` (n,)."""
        joints = self._arm.joints
        self._data.ctrl[joints.actuator] = joints.gear * position_rad

    def step(self) -> None:
        """Play one step under rope, air and gravity; raises SimulationError where the state is not finite."""
        mj, data, arm = mujoco(), self._data, self._arm
        mj.mj_objectVelocity(self._model, data, mj.mjtObj.mjOBJ_XBODY, arm.cup, self._cup_rate, 0)
        turning, speed = self._cup_rate[:3], self._cup_rate[3:]
        cup_m, ball_m_s = data.xpos[arm.cup], self._ball_rate[:3]
        rotation = data.xmat[arm.cup].reshape(3, 3)
        axis, side = rotation[:, 2], rotation @ self._side
        frame = (axis, np.cross(turning, axis), side, np.cross(turning, side))
        pull = rope_pull(
            self._law,
            tuple((self._ball - cup_m).tolist()),
            tuple((ball_m_s - speed).tolist()),
            *(tuple(one.tolist()) for one in frame),
        )
        force = np.array(pull.force_n)
        k1, k2 = self._drag
        data.xfrc_applied[arm.ball, :3] = force - (k1 + k2 * math.sqrt(ball_m_s @ ball_m_s)) * ball_m_s
        lever = cup_m + np.array(pull.pivot_m) - data.xipos[arm.cup]  # a wrench acts at the centre of mass
        data.xfrc_applied[arm.cup, :3], data.xfrc_applied[arm.cup, 3:] = -force, np.cross(lever, -force)
        mj.mj_step(self._model, data)
        if data.warning[int(mj.mjtWarning.mjWARN_BADQACC)].number or not np.isfinite(self._ball).all():
            raise SimulationError(
                "mujoco", float(data.time), "the arm in MuJoCo does not stay finite: take a smaller timestep_s"
            )

    def state(self) -> RobotState:
        """Return the true state of joints, cup and ball."""
        data, arm = self._data, self._arm
        joints = arm.joints
        cup_m, ball_m = data.xpos[arm.cup].copy(), self._ball.copy()
        in_cup_m = data.xmat[arm.cup].reshape(3, 3).T @ (ball_m - cup_m)
        # MuJoCo's sensor tells what the arm exerts on the cup
        wrench = -np.concatenate([data.sensor("kendama force").data, data.sensor("kendama torque").data])
        return RobotState(
            data.qpos[joints.position].copy(),
            data.qvel[joints.velocity].copy(),
            data.qfrc_actuator[joints.velocity].copy(),
            wrench,
            cup_m,
            ball_m,
            is_inside(in_cup_m, self._game.cup),
        )

    def scene(self) -> SceneState:
        """Return the true scene, for virtual cameras."""
        data, arm = self._data, self._arm
        rotation = data.xmat[arm.cup].reshape(3, 3).copy()
        return SceneState(data.qpos[arm.joints.position].copy(), data.xpos[arm.cup].copy(), rotation, self._ball.copy())

    def _hang(self) -> None:
        """Hold the ball still below the tie."""
        data, arm, game = self._data, self._arm, self._game
        weight_n = game.ball.mass_kg * game.gravity_m_s2
        length_m = self._law.length_m + stretch_m(weight_n, self._law.stiffness_n_m)
        tie_m = data.xpos[arm.cup] + data.xmat[arm.cup].reshape(3, 3) @ np.array(game.cup.tie_m)
        self._ball_pose[:] = (*(tie_m - [0.0, 0.0, length_m]), 1.0, 0.0, 0.0, 0.0)
        self._ball_rate[:] = 0.0
