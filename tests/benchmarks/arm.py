"""Speed of the arm's control loop, and of MuJoCo with the same arm, cup, ball and rope beside it.

``python -m tests.benchmarks.arm`` prints name, value, unit and ratio; all of it in one process on one thread, warmed
up, the best of three. MuJoCo comes with ``pip install '.[benchmarks]'``. Ratios hold from machine to machine,
absolute speeds do not. Both sides run computed torque at 1 kHz from Python while all joints sway: once with the ball
swinging on its rope, where nothing touches it, and once with the ball in the cup.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from kendama_cli.robot_model.cup import cup_frame
from kendama_cli.robot_model.friction import SIGN_RAD_S
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld
from tests.benchmarks.swing import best_rate
from tests.simulation.dart.bench_robot import bench_arm, kendama_game

STEPS = 3000
DROP_AT = 100
SWAY_RAD, RATE_RAD_S = 0.05, 6.0
BALL_M_S = 3.0
"""MuJoCo's damping is linear: the ball's is the game's drag at this speed, that of a swing's lowest point."""


def reference(home_rad: Array) -> list[tuple[Array, Array, Array]]:
    """Positions, speeds and accelerations of a sway of all joints, one sample per step."""
    t = STEP_S * np.arange(1, STEPS + 1)[:, None] * np.ones(len(home_rad))
    place = home_rad + SWAY_RAD * (1 - np.cos(RATE_RAD_S * t))
    speed = SWAY_RAD * RATE_RAD_S * np.sin(RATE_RAD_S * t)
    return list(zip(place, speed, SWAY_RAD * RATE_RAD_S**2 * np.cos(RATE_RAD_S * t), strict=True))


def dart_loop(*, in_cup: bool) -> Callable[[], int]:
    """What adapt, learn and the simulated robot run."""
    world = ArmWorld(bench_arm(), kendama_game())
    samples = reference(world.arm.home_rad)

    def work() -> int:
        world.reset(world.arm.home_rad)
        for k, sample in enumerate(samples):
            if in_cup and k == DROP_AT:
                world.ball.put([world.ball.tie_m[0], world.ball.tie_m[1], world.ball.tie_m[2] + 0.1], [0.0, 0.0, -2.0])
            world.step(*sample)
        if world.ball.is_in_cup() != in_cup:
            raise RuntimeError("the ball is not where it should be")
        return STEPS

    return work


def mujoco_model(arm: RobotModel, game: GameSettings) -> Any:
    """The arm from the same URDF with the same cup, ball and rope; the rope is a tendon with a length limit."""
    import mujoco  # noqa: PLC0415 - optional

    robot = arm.settings
    spec = mujoco.MjSpec.from_string(arm.description.urdf())
    spec.compiler.fusestatic = False
    spec.compiler.degree = False
    spec.option.timestep = STEP_S
    spec.option.gravity = [0, 0, -game.gravity_m_s2]
    base = spec.worldbody.first_body()
    base.pos = robot.base_position_m
    base.quat = [math.cos(robot.base_heading_rad / 2), 0, 0, math.sin(robot.base_heading_rad / 2)]
    for i, joint in enumerate(spec.joints):
        most = float(arm.limits.effort_nm[i])
        motor = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_motor()
        motor.forcelimited, motor.forcerange = True, [-most, most]
    tip = next(body for body in spec.bodies if body.name == arm.tip_link)
    turn = np.zeros(4)
    mujoco.mju_mat2Quat(turn, cup_frame(robot.tool.cup_axis).ravel())
    cup = tip.add_body(name="cup", pos=robot.tool.handle_m, quat=turn)
    shape = game.cup
    across = shape.mass_kg * (shape.radius_m**2 / 2 + shape.depth_m**2 / 12)
    cup.mass, cup.ipos = shape.mass_kg, [0, 0, shape.depth_m / 2]
    cup.inertia, cup.explicitinertial = [across, across, shape.mass_kg * shape.radius_m**2], True
    width, out = (shape.radius_m + shape.wall_m) * math.tan(math.pi / shape.staves), shape.radius_m + shape.wall_m / 2
    only_ball = {"contype": 0, "conaffinity": 1}
    for stave in range(shape.staves):
        angle = 2 * math.pi * stave / shape.staves
        cup.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[shape.wall_m / 2, width, shape.depth_m / 2],
            pos=[out * math.cos(angle), out * math.sin(angle), shape.depth_m / 2],
            quat=[math.cos(angle / 2), 0, 0, math.sin(angle / 2)],
            **only_ball,
        )
    floor = [shape.radius_m, shape.wall_m / 2, 0]
    cup.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=floor, pos=[0, 0, shape.wall_m / 2], **only_ball)
    cup.add_site(name="tie")
    ball = spec.worldbody.add_body(name="ball", pos=[0, 0, 0])
    for axis in np.eye(3):
        ball.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    ball.add_geom(size=[game.ball.radius_m, 0, 0], mass=game.ball.mass_kg, contype=1, conaffinity=0)
    ball.add_site(name="middle")
    rope = spec.add_tendon(name="rope", limited=True, range=[0, game.rope.length_m])
    rope.wrap_site("tie")
    rope.wrap_site("middle")
    model = spec.compile()
    n = len(arm.joint_names)
    model.dof_armature[:n] = arm.rotor_inertia_kg_m2
    linear, quadratic = game.drag
    model.dof_damping[:] = [*arm.friction.viscous_nm_s, *(linear + quadratic * BALL_M_S,) * 3]
    model.dof_frictionloss[:n] = arm.friction.coulomb_nm
    return model


def mujoco_loop(*, in_cup: bool) -> Callable[[], int]:
    """The same controller in Python on MuJoCo's inertia matrix and bias forces."""
    import mujoco  # noqa: PLC0415

    game = kendama_game()
    arm = RobotModel(bench_arm(), game.cup, game.gravity_m_s2)
    model = mujoco_model(arm, game)
    data = mujoco.MjData(model)
    n = len(arm.joint_names)
    samples = reference(arm.home_rad)
    kp, coulomb, viscous = arm.settings.stiffness_1_s2, arm.friction.coulomb_nm, arm.friction.viscous_nm_s
    kd = 2 * math.sqrt(kp)
    wanted, effort = np.zeros(model.nv), np.zeros(model.nv)
    tie = model.site("tie").id

    def work() -> int:
        mujoco.mj_resetData(model, data)
        data.qpos[:n] = arm.home_rad
        mujoco.mj_forward(model, data)
        data.qpos[n:] = data.site_xpos[tie] - [0, 0, game.rope.length_m]
        for k, (place, speed, change) in enumerate(samples):
            if in_cup and k == DROP_AT:
                data.qpos[n:], data.qvel[n:] = data.site_xpos[tie] + [0, 0, 0.1], [0, 0, -2.0]
            mujoco.mj_step1(model, data)
            wanted[:n] = change + kd * (speed - data.qvel[:n]) + kp * (place - data.qpos[:n])
            mujoco.mj_mulM(model, data, effort, wanted)
            friction = viscous * data.qvel[:n] + coulomb * np.tanh(speed / SIGN_RAD_S)
            data.ctrl[:] = effort[:n] + data.qfrc_bias[:n] + friction
            mujoco.mj_step2(model, data)
        if (np.linalg.norm(data.qpos[n:] - data.site_xpos[tie]) < game.cup.depth_m) != in_cup:
            raise RuntimeError("the ball is not where it should be")
        return STEPS

    return work


def main() -> None:
    """Print the table."""
    print("arm control loop at 1 kHz")
    for name, in_cup in (("ball on the rope", False), ("ball in the cup", True)):
        rate = best_rate(dart_loop(in_cup=in_cup))
        try:
            peer = best_rate(mujoco_loop(in_cup=in_cup))
        except ImportError:
            print(f"{name:18s} DART {rate:8.0f} steps/s   mujoco is not installed: no peer")
            continue
        print(f"{name:18s} DART {rate:8.0f} steps/s  {rate / peer:5.2f} x MuJoCo's {peer:8.0f} steps/s")


if __name__ == "__main__":
    main()
