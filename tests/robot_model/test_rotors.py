"""Rotors as armature: the diagonal of H alone, in what is believed, planned and simulated, beside other libraries."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ET
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kendama_cli.robot_model.chain import compiled_chain
from kendama_cli.robot_model.chain_kernel import ToolGeometry, efforts
from kendama_cli.robot_model.cup import TIE_MASS_KG, cup_frame
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.dart.dynamics_kernel import ArmArrays
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld
from tests.robot_model.inertia import inertia_of
from tests.robot_model.test_model import READY, ready
from tests.simulation.dart.bench_robot import kendama_game, modelled

STATES = 200
ARMS = (*READY, "fr3")
EXACT = {"rel": 1e-9, "abs": 1e-9}


def _states(arm: RobotModel, count: int = STATES) -> list[tuple[Array, Array, Array]]:
    rng, n = np.random.default_rng(5), len(arm.joint_names)
    lower, upper = np.maximum(arm.limits.lower_rad, -3.0), np.minimum(arm.limits.upper_rad, 3.0)
    return [(rng.uniform(lower, upper), rng.normal(0, 2, n), rng.normal(0, 10, n)) for _ in range(count)]


def _tool(arm: RobotModel) -> tuple[Array, Array, list[tuple[float, Array, Array]]]:
    """The cup's rotation and place in the tip link, and mass, centre and inertia about it of cup and tie."""
    cup, settings = kendama_game().cup, arm.settings.tool
    across = cup.mass_kg * (cup.radius_m**2 / 2 + cup.depth_m**2 / 12)
    ring = np.diag([across, across, cup.mass_kg * cup.radius_m**2])
    center = np.array([0.0, 0.0, cup.floor_m + cup.depth_m / 2])
    parts = [(cup.mass_kg, center, ring), (TIE_MASS_KG, np.zeros(3), 1e-10 * np.eye(3))]
    return cup_frame(settings.cup_axis), np.array(settings.handle_m), parts


def _pinocchio(arm: RobotModel) -> Any:
    pin = pytest.importorskip("pinocchio")
    whole = pin.buildModelFromUrdf(arm.settings.path)
    others = [whole.getJointId(name) for name in list(whole.names)[1:] if name not in arm.joint_names]
    model = pin.buildReducedModel(whole, others, pin.neutral(whole))
    frame = model.frames[model.getFrameId(arm.tip_link)]
    rotation, position, parts = _tool(arm)
    for mass, center, inertia in parts:
        at = frame.placement * pin.SE3(rotation, position)
        model.appendBodyToJoint(frame.parentJoint, pin.Inertia(mass, center, inertia), at)
    model.armature = arm.rotor_inertia_kg_m2
    return pin, model, model.createData()


def _mujoco(arm: RobotModel) -> Any:
    mujoco = pytest.importorskip("mujoco")
    spec = mujoco.MjSpec.from_string(arm.description.urdf())
    spec.compiler.fusestatic, spec.compiler.balanceinertia = False, False
    spec.compiler.boundmass, spec.compiler.boundinertia = 0.0, 0.0
    spec.compiler.degree = False
    spec.option.gravity = [0, 0, -arm.gravity_m_s2]
    tip = next(body for body in spec.bodies if body.name == arm.tip_link)
    rotation, position, parts = _tool(arm)
    for mass, center, inertia in parts:
        body = tip.add_body(pos=position, quat=np.roll(Rotation.from_matrix(rotation).as_quat(), 1))
        body.mass, body.ipos, body.inertia, body.explicitinertial = mass, center, np.diag(inertia), True
    model = spec.compile()
    model.dof_armature[:] = arm.rotor_inertia_kg_m2
    return mujoco, model, mujoco.MjData(model)


def _by_hand(arm: RobotModel, position: Array) -> Array:
    """H as the sum of m Jv^T Jv + Jw^T I Jw over all links of the file, and the rotors."""
    root, names = ET.parse(arm.settings.path).getroot(), list(arm.joint_names)
    parents = {joint.find("child").get("link"): joint for joint in root.findall("joint")}

    def numbers(element: Any, name: str, default: str = "0 0 0") -> Array:
        return np.array([float(word) for word in ((None if element is None else element.get(name)) or default).split()])

    def placed(element: Any) -> Array:
        made = np.eye(4)
        made[:3, :3] = Rotation.from_euler("xyz", numbers(element.find("origin"), "rpy")).as_matrix()
        made[:3, 3] = numbers(element.find("origin"), "xyz")
        return made

    total = np.diag(arm.rotor_inertia_kg_m2)
    rotation, place, parts = _tool(arm)
    tool = np.eye(4)
    tool[:3, :3], tool[:3, 3] = rotation, place
    for link in root.findall("link"):
        chain, name = [], link.get("name")
        while name in parents:
            chain.insert(0, parents[name])
            name = parents[name].find("parent").get("link")
        pose, screws = np.eye(4), []
        for joint in chain:
            pose = pose @ placed(joint)
            if joint.get("name") in names:
                axis = numbers(joint.find("axis"), "xyz", "1 0 0")
                i, axis = names.index(joint.get("name")), axis / np.linalg.norm(axis)
                screws.append((i, pose[:3, :3] @ axis, pose[:3, 3].copy()))
                pose[:3, :3] = pose[:3, :3] @ Rotation.from_rotvec(axis * position[i]).as_matrix()
        bodies = [(tool, *part) for part in parts] if link.get("name") == arm.tip_link else []
        if (own := link.find("inertial")) is not None:
            values = own.find("inertia").attrib
            names_of = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))
            inertia = np.array([[float(values.get(one, 0)) for one in row] for row in names_of])
            bodies.append((placed(own), float(own.find("mass").get("value")), np.zeros(3), inertia))
        for inner, mass, center, inertia in bodies:
            at = pose @ inner
            middle, turned = at[:3, :3] @ center + at[:3, 3], at[:3, :3] @ inertia @ at[:3, :3].T
            linear, angular = np.zeros((3, len(names))), np.zeros((3, len(names)))
            for i, axis, origin in screws:
                angular[:, i], linear[:, i] = axis, np.cross(axis, middle - origin)
            total = total + mass * linear.T @ linear + angular.T @ turned @ angular
    return total


def _friction_free(robot: RobotSettings) -> RobotSettings:
    none = (0.0,) * len(robot.home_rad or ())
    return dataclasses.replace(robot, coulomb_nm=none, stribeck_nm=none, viscous_nm_s=none)


@pytest.mark.parametrize("name", ARMS)
def test_inertia_and_torques_are_those_of_pinocchio_with_an_armature(name: str) -> None:
    arm = modelled(_friction_free(ready(name)))
    pin, model, data = _pinocchio(arm)
    dynamics, chain = ArmArrays(arm, kendama_game(), links=False), compiled_chain(arm, with_tool=True)
    tool = ToolGeometry(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.0)
    for position, velocity, change in _states(arm):
        dynamics.move(position, velocity)
        inertia = np.triu(pin.crba(model, data, position))
        assert dynamics.inertia == pytest.approx(inertia + np.triu(inertia, 1).T, **EXACT)
        assert dynamics.bias == pytest.approx(pin.nonLinearEffects(model, data, position, velocity), **EXACT)
        torque = pin.rnea(model, data, position, velocity, change)
        assert arm.rigid_effort_nm(position, velocity, change) == pytest.approx(torque, **EXACT)
        assert efforts(chain, tool, position, velocity, change) == pytest.approx(torque, **EXACT)


@pytest.mark.parametrize("name", ARMS)
def test_inertia_and_torques_are_those_of_mujoco_with_an_armature(name: str) -> None:
    arm = modelled(ready(name))
    mujoco, model, data = _mujoco(arm)
    dynamics = ArmArrays(arm, kendama_game(), links=False)
    for position, velocity, change in _states(arm):
        dynamics.move(position, velocity)
        data.qpos[:], data.qvel[:] = position, velocity
        mujoco.mj_forward(model, data)
        columns = np.zeros((model.nv, model.nv))
        for column, unit in zip(columns, np.eye(model.nv), strict=True):
            mujoco.mj_mulM(model, data, column, unit)
        assert dynamics.inertia == pytest.approx(columns, **EXACT)
        assert dynamics.bias == pytest.approx(data.qfrc_bias, **EXACT)
        torque = arm.rigid_effort_nm(position, velocity, change)
        assert torque == pytest.approx(columns @ change + data.qfrc_bias, **EXACT)


@pytest.mark.parametrize("name", ARMS)
def test_inertia_is_that_of_the_file_s_links_with_rotors_on_the_diagonal(name: str) -> None:
    arm = modelled(ready(name))
    for position, _, _ in _states(arm, 20):
        expected = _by_hand(arm, position)
        assert inertia_of(arm, position) == pytest.approx(expected, **EXACT)
        dynamics = ArmArrays(arm, kendama_game(), links=False)
        dynamics.move(position, np.zeros(len(position)))
        assert dynamics.inertia == pytest.approx(expected, **EXACT)


@pytest.mark.parametrize("name", ARMS)
def test_the_simulated_arm_accelerates_as_its_inertia_with_rotors_says(name: str) -> None:
    """H (v' - v) = T (tau - C v - g), H from the file by hand: DART itself knows no armature."""
    world = ArmWorld(_friction_free(ready(name)), kendama_game())
    arm, still = world.arm, np.zeros_like(world.arm.home_rad)
    for position, velocity, _ in _states(arm, 20):
        inside = np.clip(position, arm.limits.lower_rad + 0.3, arm.limits.upper_rad - 0.3)
        slow = velocity * np.minimum(1.0, 0.5 * arm.limits.velocity_rad_s / np.abs(velocity).max())
        world.reset(inside, slow)
        world.ball.put((world.ball.tie_m - np.array([0, 0, 0.2])).tolist(), [0, 0, 0])  # the rope is slack
        world.step(inside, still, still)
        expected = np.linalg.solve(_by_hand(arm, inside), world.effort_nm - arm.rigid_effort_nm(inside, slow, still))
        assert (world.velocity_rad_s - slow) / STEP_S == pytest.approx(expected, rel=1e-8, abs=1e-7)
