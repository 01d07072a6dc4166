"""The arm under task-space control among bodies: statics, passivity, sensing, limits and errors."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.errors import ConfigError, SimulationError
from kendama_cli.motion.rotation import exp_of
from kendama_cli.plugins.interact.conformance import resting_at
from kendama_cli.plugins.interact.impedance_law import pose_error
from kendama_cli.plugins.interact.interface import JointTorque
from kendama_cli.plugins.interact.settings import ProbeSettings, make_controller
from kendama_cli.plugins.interact.world import ProbeWorld, coriolis_nm
from kendama_cli.simulation.dart.world import STEP_S
from tests.plugins.interact.shipped_scene import body, controller, press, scene
from tests.simulation.dart.bench_robot import bench_arm, frictionless_bench_arm

PROBE = press().probe
GRAVITY_M_S2 = 9.81
STILL = np.zeros(7)


def _world(*bodies, robot=None, probe: ProbeSettings = PROBE) -> ProbeWorld:
    return ProbeWorld(robot or frictionless_bench_arm(), press(probe=dataclasses.asdict(probe)), scene(*bodies))


def _hold(world, kind="impedance", *, steps, push_n=None, reference=None, after=None, **changed):
    """Hold ``reference`` (where the tool is now); ``after(state)`` is called after every step."""
    reference = reference or resting_at(world.state)
    made = make_controller(controller(kind, **changed))
    made.reset(world.position_rad)
    for _ in range(steps):
        if push_n is not None:
            world.body.cup.addExtForce(push_n)
        world.step(made.command(world.state, reference, STEP_S))
        if after is not None:
            after(world.state)
    return reference


@pytest.mark.parametrize("load_n", [(0.0, 0.0, 15.0), (5.0, 5.0, -5.0)])
def test_a_known_load_deflects_the_tool_by_force_over_stiffness(load_n):
    stiffness = np.array([1500.0, 900.0, 600.0])
    world = _world()
    reference = _hold(world, steps=4000, push_n=np.array(load_n), stiffness_n_m=stiffness.tolist())
    assert np.abs(world.velocity_rad_s).max() < 1e-5
    # the load turns nothing, for it acts on the tool's centre
    assert world.state.tool_m - reference.position_m == pytest.approx(np.array(load_n) / stiffness, rel=1e-4, abs=2e-6)
    assert pose_error(reference, world.state, spin_free=True)[3:] == pytest.approx(np.zeros(3), abs=1e-4)


def test_a_step_of_the_reference_is_followed_without_overshoot_where_damping_is_critical():
    world = _world()
    start = world.state
    away = dataclasses.replace(resting_at(start), position_m=start.tool_m + np.array([0.02, 0.0, 0.01]))
    seen = []
    _hold(world, steps=1500, reference=away, after=lambda state: seen.append(state.tool_m - away.position_m))
    assert np.abs(seen[-1]).max() < 1e-4
    assert max(np.max(seen, axis=0)[[0, 2]]) < 1e-4  # 0.5 % of the step: the modes bend as the arm moves


def test_coriolis_forces_take_no_energy_from_any_motion():
    """s^T (H' / 2 - C(q, q')) s = 0 for every s, H' being the inertia's change along q'; and C q' is DART's own."""
    rng = np.random.default_rng(6)
    world = _world()
    skeleton = world.body.skeleton
    for _ in range(5):
        position, speed, s = rng.uniform(-1, 1, (3, 7))
        inertias = []
        for side in (1e-5, -1e-5):
            skeleton.setPositions(position + side * speed)
            inertias.append(skeleton.getMassMatrix())
        skeleton.setPositions(position)
        skeleton.setVelocities(speed)
        rate = (inertias[0] - inertias[1]) / 2e-5
        scale = float(s @ rate @ s)
        assert s @ (rate @ s / 2 - coriolis_nm(skeleton, s)) == pytest.approx(0.0, abs=1e-6 * max(1.0, abs(scale)))
        assert coriolis_nm(skeleton, speed) == pytest.approx(skeleton.getCoriolisForces(), abs=1e-9)


@pytest.mark.parametrize(
    ("restitution", "friction", "growth"),
    # contacts are solved to 1e-5; a strike's rebound is only as exact as the step in which it happens; with friction
    # beside it, Newton's rebound is itself not passive (Kane's example), so that is no law of the controller
    [(0.0, 0.0, 1e-6), (0.0, 0.5, 1e-6), (0.9, 0.0, 1e-3)],
)
def test_energy_in_contact_with_a_passive_wall_never_grows(restitution, friction, growth):
    """Kinetic energy and that of the springs, while the tool strikes a wall that stands in its way, and rests there."""
    wall = body(position_m=[0.13, 0.0, 1.2], size_m=[0.1, 0.6, 0.6], restitution=restitution, friction=friction)
    world = _world(wall, probe=dataclasses.replace(PROBE, restitution=1.0))
    start = world.state
    beyond = dataclasses.replace(
        resting_at(start),
        position_m=start.tool_m + np.array([0.12, 0.02, 0.01]),
        rotation=exp_of([0.0, 0.2, 0.0]) @ start.tool_rotation,
    )
    stiffness = np.array([150.0, 100.0, 80.0, 6.0, 6.0, 6.0])

    def energy_j(state):
        return (
            float(world.body.skeleton.computeKineticEnergy())
            + float(stiffness @ pose_error(beyond, state, spin_free=True) ** 2) / 2
        )

    energies, touched, efforts = [energy_j(start)], [], []
    _hold(
        world,
        steps=2500,
        reference=beyond,
        after=lambda state: (
            energies.append(energy_j(state)),
            touched.append(world.touched),
            efforts.append(np.abs(world.effort_nm) / world.arm.limits.effort_nm),
        ),
        stiffness_n_m=stiffness[:3].tolist(),
        stiffness_nm_rad=6.0,
        damping_ratio=0.2,
        posture_1_s2=0.0,
    )
    assert touched.count("table") > 200
    assert np.max(efforts) < 1  # where a motor gives less than it is asked for, nothing is promised
    assert np.diff(energies).max() < growth * energies[0]
    assert energies[-1] < 0.3 * energies[0]


def test_the_wrist_feels_the_tools_weight_at_rest_and_the_contact_when_it_presses():
    world = _world(body(position_m=[0.0, 0.0, 1.158]))
    _hold(world, steps=500)
    weight = PROBE.mass_kg * GRAVITY_M_S2
    tip = world.body.skeleton.getBodyNode(world.arm.tip_link).getWorldTransform()

    def felt():
        return tip.rotation() @ world.wrench[:3], tip.rotation() @ world.wrench[3:]

    force, torque = felt()
    lever = world.state.tool_m - tip.translation()
    assert force == pytest.approx([0, 0, -weight], abs=1e-6)
    assert torque == pytest.approx(np.cross(lever, [0, 0, -weight]), abs=1e-6)
    down = np.array([0.0, 0.0, -1.0])
    pressing = dataclasses.replace(resting_at(world.state), force_n=25.0 * down, force_axis=down, force_share=1.0)
    _hold(world, "force", steps=1500, reference=pressing)
    assert world.touched == "table"
    assert world.contact_n[2] == pytest.approx(-25.0, abs=0.02)
    force, torque = felt()
    assert force == pytest.approx([0, 0, -weight] - world.contact_n, abs=5e-3)
    below = np.array([0.0, 0.0, -PROBE.radius_m])
    wanted = np.cross(lever, force) - np.cross(below, world.contact_n)
    assert torque == pytest.approx(wanted, abs=5e-3)  # the contact is 0.1 mm or so inside


def test_what_happened_in_another_world_changes_nothing():
    paths = []
    for _ in range(2):
        world = _world(body(position_m=[0.0, 0.0, 1.15]), robot=bench_arm())
        reference = resting_at(world.state)
        lower = dataclasses.replace(reference, position_m=reference.position_m - [0.0, 0.0, 0.03])
        seen: list[list[float]] = []
        _hold(world, steps=400, reference=lower, after=lambda state: seen.append(state.position_rad.tolist()))  # noqa: B023
        paths.append(seen)
        assert world.touched == "table"
    assert paths[0] == paths[1]


def test_a_torque_that_is_not_finite_stops_the_simulation_and_names_the_joint():
    world = _world()
    torque = STILL.copy()
    torque[4] = np.nan
    with pytest.raises(SimulationError, match=r"the torque of joint 'e2' of pa10 is nan at 0\.000 s; .*stiffness"):
        world.step(JointTorque(torque, STILL))
    torque[4], torque[1] = 0.0, np.inf
    with pytest.raises(SimulationError) as caught:
        world.step(JointTorque(torque, STILL))
    assert caught.value.quantity == "s2"


def test_efforts_are_clipped_to_the_joints_limits():
    world = _world()
    for sign in (1.0, -1.0):
        world.step(JointTorque(sign * np.full(7, 1e6), STILL))
        assert world.effort_nm == pytest.approx(sign * world.arm.limits.effort_nm)


def test_a_body_where_the_arm_stands_is_refused():
    base_m = bench_arm().base_position_m
    with pytest.raises(ConfigError, match=r"\(table\) overlaps with the arm's base by \d+ mm"):
        _world(body(position_m=[base_m[0], base_m[1], base_m[2] + 0.1]))
    with pytest.raises(ConfigError, match=r"\(table\) overlaps with the tool at home by \d+ mm"):
        _world(body(position_m=[0.0, 0.0, 1.19]))
