from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from kendama_cli.errors import ConfigError, InputError
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.settings import build
from kendama_cli.settings.robot import PER_JOINT, RobotSettings
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld
from tests.extras import require_robot_descriptions
from tests.robot_model.inertia import inertia_of
from tests.simulation.dart.bench_robot import ROOT, bench_arm, kendama_game, modelled

EXTRA = ("panda", "ur10", "ur5", "xarm7")
READY = ("pa10", "iiwa", *EXTRA)


def ready(name: str) -> RobotSettings:
    """A shipped node of the group robot, its description found as the caretaker finds it."""
    if name in EXTRA:
        require_robot_descriptions()
    values = yaml.safe_load((ROOT / "conf/robot" / f"{name}.yaml").read_text())
    found: RobotSettings = resolve_files(build(RobotSettings, values, "robot"), "robot", [ROOT])
    return found


def bare() -> RobotSettings:
    """The PA10 as one who knows nothing but its URDF would give it."""
    return dataclasses.replace(bench_arm(), tip_link=None, **dict.fromkeys(PER_JOINT))


@pytest.mark.parametrize("name", READY)
def test_every_ready_arm_holds_the_cup_upright_over_the_origin_within_its_limits(name: str) -> None:
    arm = modelled(ready(name))
    value, _ = arm.cup_task(arm.home_rad)
    assert value == pytest.approx([0, 0, 1.2, 0, 0], abs=2e-4)
    assert (arm.home_rad > arm.limits.lower_rad + 0.1).all()
    assert (arm.home_rad < arm.limits.upper_rad - 0.1).all()


@pytest.mark.parametrize("name", READY)
def test_every_ready_arm_stands_still_and_sways_in_closed_loop(name: str) -> None:
    world = ArmWorld(ready(name), kendama_game())
    home, one = world.arm.home_rad, np.ones(len(world.arm.joint_names))
    for k in range(1, 500):
        t = k * STEP_S
        world.step(home + 0.02 * (1 - math.cos(6 * t)), one * 0.12 * math.sin(6 * t), one * 0.72 * math.cos(6 * t))
        assert (np.abs(world.effort_nm) < world.arm.limits.effort_nm).all()
    assert np.abs(world.position_rad - home - 0.02 * (1 - math.cos(6 * t))).max() < 1e-3


def test_the_iiwa_has_the_published_lengths_speeds_and_torques() -> None:
    arm = modelled(ready("iiwa"))
    positions = dict(zip((*arm.joint_names, "flange"), arm.joint_positions_m(np.zeros(7)), strict=True))
    base = np.array(arm.settings.base_position_m)
    heights = [float((positions[name] - base)[2]) for name in ("a2", "a4", "a6", "flange")]
    assert np.diff([0.0, *heights]) == pytest.approx([0.36, 0.42, 0.40, 0.126], abs=1e-9)
    assert np.degrees(arm.limits.velocity_rad_s) == pytest.approx([85, 85, 100, 75, 130, 135, 135], abs=1e-3)
    assert arm.limits.effort_nm == pytest.approx([320, 320, 176, 176, 110, 40, 40])
    assert arm.new_body().skeleton.getMass() == pytest.approx(29.9 + kendama_game().cup.mass_kg, abs=0.01)


def test_what_the_settings_leave_open_the_arm_finds() -> None:
    arm = modelled(bare())
    assert arm.tip_link == "flange"
    assert arm.home_rad == pytest.approx((arm.limits.lower_rad + arm.limits.upper_rad) / 2)
    assert arm.limits.acceleration_rad_s2 == pytest.approx(arm.limits.velocity_rad_s / 0.15)
    assert arm.redundancy_weights == pytest.approx(arm.limits.velocity_rad_s**-2.0)
    assert (arm.link_radius_m > 0).all()
    for none in (arm.friction.coulomb_nm, arm.friction.viscous_nm_s, arm.friction.stribeck_nm, arm.rotor_inertia_kg_m2):
        assert none.tolist() == [0.0] * 7


def test_rotors_make_a_joint_as_sluggish_as_they_are_heavy() -> None:
    heavy = RobotModel(
        dataclasses.replace(bare(), rotor_inertia_kg_m2=(0.0,) * 6 + (0.3,)),
        kendama_game().cup,
        kendama_game().gravity_m_s2,
    )
    light = modelled(bare())
    gain = inertia_of(heavy, heavy.home_rad) - inertia_of(light, light.home_rad)
    assert gain[6, 6] == pytest.approx(0.3)


def test_a_path_must_be_given() -> None:
    with pytest.raises(ConfigError, match=r"'robot\.path' is empty; set it to a robot description"):
        build(RobotSettings, yaml.safe_load((ROOT / "conf/robot/urdf.yaml").read_text()), "robot")


def test_any_urdf_will_do_with_nothing_else_said(tmp_path: Path) -> None:
    file = tmp_path / "mine.urdf"
    file.write_text(Path(bench_arm().path).read_text())
    values = yaml.safe_load((ROOT / "conf/robot/urdf.yaml").read_text()) | {"path": str(file)}
    world = ArmWorld(build(RobotSettings, values, "robot"), kendama_game())
    world.step(world.arm.home_rad, np.zeros(7), np.zeros(7))
    assert world.arm.joint_names == ("s1", "s2", "s3", "e1", "e2", "w1", "w2")


@pytest.mark.parametrize("name", [name for name in PER_JOINT if name != "home_rad"])
def test_a_joint_list_that_does_not_fit_the_arm_is_named(name: str) -> None:
    with pytest.raises(InputError, match=rf"has 7 moving joints on the way to 'flange', robot\.{name} has 3"):
        RobotModel(
            dataclasses.replace(bare(), **{name: (1.0, 1.0, 1.0)}), kendama_game().cup, kendama_game().gravity_m_s2
        )


def test_a_held_joint_stays_where_it_is() -> None:
    arm = modelled(dataclasses.replace(bare(), locked_joints=("s3",)))
    assert arm.joint_names == ("s1", "s2", "e1", "e2", "w1", "w2")
    assert inertia_of(arm, arm.home_rad).shape == (6, 6)


def test_a_body_s_joints_have_the_arm_s_limits_and_a_state_is_put_without_forces() -> None:
    arm = modelled(
        dataclasses.replace(bench_arm(), velocity_rad_s=(0.5,) * 7, effort_nm=(33.0,) * 7, lower_rad=(-1.1,) * 7)
    )
    body, limits = arm.new_body(), arm.limits
    found = [
        (
            joint.getPositionLowerLimit(0), joint.getPositionUpperLimit(0), joint.getVelocityLowerLimit(0),
            joint.getVelocityUpperLimit(0), joint.getForceLowerLimit(0), joint.getForceUpperLimit(0),
        )
        for joint in body.joints
    ]  # fmt: skip
    speed, effort = limits.velocity_rad_s, limits.effort_nm
    bounds = np.array([limits.lower_rad, limits.upper_rad, -speed, speed, -effort, effort])
    assert np.abs(np.transpose(found) - bounds).max() < 1e-12
    body.skeleton.setForces(np.ones(7))
    body.put(arm.home_rad, 0.1 * np.arange(7))
    assert body.skeleton.getPositions() == pytest.approx(arm.home_rad)
    assert body.skeleton.getVelocities() == pytest.approx(0.1 * np.arange(7))
    assert not body.skeleton.getForces().any()
    assert all(joint.areLimitsEnforced() for joint in body.joints)
