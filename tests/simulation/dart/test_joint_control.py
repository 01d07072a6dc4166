from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.artifacts.friction_model import ParametricFriction
from kendama_cli.robot_model.dart_library import dartpy
from kendama_cli.robot_model.friction import SIGN_RAD_S
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart import torque_kernel
from kendama_cli.simulation.dart.arm_errors import WorldErrors
from kendama_cli.simulation.dart.joint_control import JointFriction
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld
from tests.simulation.dart.bench_robot import bench_arm, frictionless_bench_arm, kendama_game, modelled

COULOMB, STRIBECK, SPEED, VISCOUS = 2.0, 1.0, 0.1, 3.0
INERTIA = 0.5


WAYS = ("constraint", "compiled")
"""DART's constraint beside contacts, compiled code where nothing touches."""


def uncompensated(friction: JointFriction, torque_nm: float, velocity_rad_s: Array) -> Array:
    """What the motors give for a controller that knows of no friction; the friction's level is set."""
    none, effort = np.zeros_like(velocity_rad_s), np.empty_like(velocity_rad_s)
    viscous = friction.constants[torque_kernel.VISCOUS] * velocity_rad_s  # what the controller would add at any speed
    assert torque_kernel.efforts(
        torque_nm - viscous,
        none,
        velocity_rad_s,
        none,
        friction.constants,
        friction.unknown,
        effort,
        friction.level_nm,
    )
    return effort


class Wheel:
    """One joint about the vertical with a known inertia: what friction does to it has a closed form."""

    def __init__(self, way: str, inertia_kg_m2: float = INERTIA) -> None:
        self.way, self.inertia_kg_m2 = way, inertia_kg_m2
        self.skeleton = dartpy.dynamics.Skeleton("wheel")
        self.joint, body = self.skeleton.createRevoluteJointAndBodyNodePair()
        self.joint.setAxis(np.array([0.0, 0.0, 1.0]))
        body.setInertia(dartpy.dynamics.Inertia(1.0, np.zeros(3), np.eye(3) * inertia_kg_m2))
        self.world = dartpy.simulation.World()
        self.world.setTimeStep(STEP_S)
        self.world.addSkeleton(self.skeleton)
        known = ParametricFriction(*(np.array([value]) for value in (COULOMB, STRIBECK, SPEED, VISCOUS, 0.0)))
        self.friction = JointFriction([self.joint], known, np.array([1e3]))

    def turn(self, torque_nm: float, steps: int, speed_rad_s: float = 0.0) -> Array:
        self.skeleton.setVelocities([speed_rad_s])
        speeds = []
        for _ in range(steps):
            speed = self.skeleton.getVelocities()
            effort = uncompensated(self.friction, torque_nm, speed)
            if self.way == "constraint":
                self.joint.setCoulombFriction(0, float(self.friction.level_nm[0]))
            else:
                effort = effort + self.compiled(effort, speed)
            self.skeleton.setForces(effort)
            self.world.step()
            speeds.append(self.skeleton.getVelocities()[0])
        return np.array(speeds)

    def compiled(self, effort: Array, speed: Array) -> Array:
        viscous = self.joint.getDampingCoefficient(0)
        diagonal, found = np.array([self.inertia_kg_m2 + STEP_S * viscous]), np.empty(1)
        factor = 1.0 / np.sqrt(diagonal)[None]
        load = effort - viscous * speed
        assert torque_kernel.held(factor, diagonal, speed, load, self.friction.level_nm, STEP_S, found)
        return found


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_joint_at_rest_stays_until_the_torque_exceeds_its_breakaway_friction(way: str, share: float) -> None:
    breakaway = (COULOMB + STRIBECK) * (1 + share)
    for torque, moves in ((0.99 * breakaway, False), (-0.99 * breakaway, False), (1.01 * breakaway, True)):
        wheel = Wheel(way)
        wheel.friction.set_unknown(0.0, share)
        assert (np.abs(wheel.turn(torque, 300)).max() > 1e-9) == moves


@pytest.mark.parametrize("way", WAYS)
def test_a_turning_joint_slows_down_as_the_law_says_and_stops_for_good(way: str) -> None:
    """J v' = -(Fc + Fs exp(-(v/vs)^2)) sign v - b v, integrated finely by RK4."""

    def change(v: float) -> float:
        return -((COULOMB + STRIBECK * math.exp(-((v / SPEED) ** 2))) + VISCOUS * v) / INERTIA

    speeds = Wheel(way).turn(0.0, 600, speed_rad_s=1.0)
    v, h = 1.0, STEP_S / 10
    for k in range(100):
        for _ in range(10):
            k1 = change(v)
            k2 = change(v + h / 2 * k1)
            k3 = change(v + h / 2 * k2)
            v += h / 6 * (k1 + 2 * k2 + 2 * k3 + change(v + h * k3))
        # one step of friction is the error of a first-order integrator
        assert speeds[k] == pytest.approx(v, abs=STEP_S * (COULOMB + STRIBECK + VISCOUS) / INERTIA)
    assert (np.abs(speeds[400:]) < 1e-12).all()


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("inertia", [INERTIA, 1e-2, 1e-3, 1e-4])
def test_friction_never_adds_energy_however_light_the_joint_is(way: str, inertia: float) -> None:
    speeds = Wheel(way, inertia).turn(0.0, 500, speed_rad_s=-2.0)
    rounding = 1e-9  # of the constraint solver
    assert (np.diff(np.abs(speeds)) <= rounding).all()
    assert (speeds <= rounding).all()
    assert abs(speeds[-1]) < 1e-12


def test_the_controller_that_knows_all_friction_follows_as_if_there_were_none() -> None:
    """Away from reversals: there the sign of what is compensated is blurred on purpose."""
    errors = {}
    for name, robot in (("none", frictionless_bench_arm()), ("known", bench_arm())):
        world = ArmWorld(robot, kendama_game())
        worst = 0.0
        for k in range(1, 1200):
            t = k * STEP_S
            ramp = np.full(7, 0.1 * (t - math.sin(4 * t) / 4))
            world.step(
                world.arm.home_rad + ramp,
                np.full(7, 0.1 * (1 - math.cos(4 * t))),
                np.full(7, 0.4 * math.sin(4 * t)),
            )
            if t > 0.5:
                worst = max(worst, float(np.abs(world.position_rad - world.arm.home_rad - ramp).max()))
        errors[name] = worst
    assert errors["known"] < errors["none"] + 2e-4


def test_unknown_shares_scale_every_known_friction() -> None:
    arm = modelled(bench_arm())
    known, joints = arm.friction, arm.new_body().joints
    friction = JointFriction(joints, known, arm.limits.effort_nm)
    friction.set_unknown(0.25, 0.1)
    assert not uncompensated(friction, 0.0, np.zeros(7)).any()
    assert friction.level_nm == pytest.approx(1.1 * (known.coulomb_nm + known.stribeck_nm) + 0.25)
    # far above the Stribeck speed the rest is Coulomb's
    uncompensated(friction, 0.0, np.full(7, 5.0))
    assert friction.level_nm == pytest.approx(1.1 * known.coulomb_nm + 0.25)
    assert not any(joint.getCoulombFriction(0) for joint in joints)
    assert [joint.getDampingCoefficient(0) for joint in joints] == pytest.approx(1.1 * known.viscous_nm_s)


def test_the_motors_give_what_is_asked_with_the_law_of_the_known_friction_within_their_limits() -> None:
    """The compiled law beside ParametricFriction, in whose direction the sign of the wanted speed is blurred."""
    arm = modelled(bench_arm())
    friction = JointFriction(arm.new_body().joints, arm.friction, arm.limits.effort_nm)
    rng = np.random.default_rng(7)
    clipped = 0
    for size in (0.01, 0.1, 1.0, 10.0):
        for _ in range(50):
            desired, speed, torque, added = size * rng.normal(size=(4, 7))
            torque *= arm.limits.effort_nm
            effort = np.empty(7)
            torque_kernel.efforts(
                torque, added, speed, desired, friction.constants, friction.unknown, effort, friction.level_nm
            )
            direction = np.tanh(desired / SIGN_RAD_S)
            compensated = arm.friction.dry_nm(desired) * direction + arm.friction.viscous_nm_s * speed
            asked = torque + compensated + added
            clipped += int((np.abs(asked) > arm.limits.effort_nm).sum())
            # a handful of roundings of torques up to a thousand Nm
            assert effort == pytest.approx(np.clip(asked, -arm.limits.effort_nm, arm.limits.effort_nm), abs=1e-11)
            assert friction.level_nm == pytest.approx(arm.friction.dry_nm(speed), abs=1e-11)
    assert 0 < clipped < 1400


def test_the_friction_of_coupled_joints_obeys_coulomb_s_law() -> None:
    """Of every joint: it rests, or its friction is at its level against its speed; as coupled as an arm's."""
    rng, resting = np.random.default_rng(3), 0
    for _ in range(300):
        n = int(rng.integers(1, 9))
        root = rng.normal(size=(n, n)) * np.exp(rng.normal(0.0, 1.0, n))
        matrix = root @ root.T
        matrix += 1e-3 * np.trace(matrix) * np.eye(n)
        level, speed = rng.exponential(1.0, n), rng.normal(0.0, 1e-3, n) * rng.integers(0, 2, n)
        load, found = rng.normal(0.0, 1.5, n), np.empty(n)
        factor = np.linalg.cholesky(matrix)
        np.fill_diagonal(factor, 1.0 / np.diag(factor))
        assert torque_kernel.held(factor, np.diag(matrix).copy(), speed, load, level, STEP_S, found)
        after = speed + STEP_S * np.linalg.solve(matrix, load + found)
        assert (np.abs(found) <= level).all()
        rounding = 1e-9 * (np.abs(after).max() + np.abs(speed).max() + STEP_S)
        moves = np.abs(after) > rounding
        assert found[moves] == pytest.approx(-level[moves] * np.sign(after[moves]))
        resting += int((~moves).sum())
    assert resting > 200


def test_two_percent_of_friction_that_nobody_knows_costs_little() -> None:
    game, worst = kendama_game(), []
    for fraction in (0.0, 0.02, 0.5):
        world = ArmWorld(bench_arm(), game)
        world.perturb(WorldErrors(joint_friction_fraction=fraction))
        world.reset(world.arm.home_rad)
        for k in range(1, 600):
            t = k * STEP_S
            world.step(
                world.arm.home_rad + 0.05 * (1 - math.cos(6 * t)),
                np.full(7, 0.3 * math.sin(6 * t)),
                np.full(7, 1.8 * math.cos(6 * t)),
            )
        worst.append(float(np.abs(world.position_rad - world.arm.home_rad - 0.05 * (1 - math.cos(6 * 0.599))).max()))
    assert worst[1] < worst[0] + 1e-4
    assert worst[2] > worst[1]


def test_a_robot_without_friction_values_has_none() -> None:
    bare = dataclasses.replace(bench_arm(), coulomb_nm=None, viscous_nm_s=None, stribeck_nm=None, stribeck_rad_s=None)
    arm = modelled(bare)
    assert not arm.friction.coulomb_nm.any()
    assert not arm.friction.viscous_nm_s.any()
    assert not arm.friction.stribeck_nm.any()
