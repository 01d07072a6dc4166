"""The bodies of a scene obey mechanics."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.plugins.interact.scene import Scene, check_clear, depth_m
from kendama_cli.robot_model.dart_library import dartpy
from kendama_cli.simulation.dart.world import STEP_S
from tests.plugins.interact.shipped_scene import body, scene

GRAVITY_M_S2 = 9.81


def _free(name, shape, size_m, position_m, **changed):
    values = body() | {"kind": "free", "name": name, "shape": shape, "size_m": size_m, "mass_kg": 0.4}
    return values | {"position_m": position_m} | changed


def _named(name, **changed):
    return body(**changed) | {"name": name}


def _world(*bodies):
    world = dartpy.simulation.World()
    world.setTimeStep(STEP_S)
    world.setGravity(np.array([0.0, 0.0, -GRAVITY_M_S2]))
    sleep = world.getDeactivationOptions()
    sleep.mEnabled = False
    world.setDeactivationOptions(sleep)
    world.getConstraintSolver().setCollisionDetector(dartpy.collision.BulletCollisionDetector())
    added = Scene(world, scene(*bodies))
    return lambda: (added.pull(), world.step()), added.bodies


def _place(made):
    return np.array(made.getWorldTransform().translation())


@pytest.mark.parametrize(
    ("shape", "size_m", "half_height_m"),
    [("box", [0.1, 0.06, 0.08], 0.04), ("cylinder", [0.04, 0.1], 0.05), ("sphere", [0.03], 0.03)],
)
def test_a_free_body_falls_onto_the_table_and_rests_there(shape, size_m, half_height_m):
    step, bodies = _world(body(), _free("block", shape, size_m, [0.05, 0.0, 1.1]))
    for _ in range(100):
        step()
    # semi-implicit Euler falls by g dt^2 n (n + 1) / 2
    assert _place(bodies["block"])[2] == pytest.approx(1.1 - GRAVITY_M_S2 * STEP_S**2 * 100 * 101 / 2, abs=1e-9)
    for _ in range(1400):
        step()
    assert _place(bodies["block"])[2] == pytest.approx(1.0 + half_height_m, abs=1e-3)
    assert bodies["block"].getSpatialVelocity() == pytest.approx(np.zeros(6), abs=1e-3)
    assert _place(bodies["table"]) == pytest.approx([0.0, 0.0, 0.98])


@pytest.mark.parametrize("friction", [0.2, 0.5])
def test_a_block_on_a_slope_stays_below_the_angle_of_friction_and_slides_above_it(friction):
    for angle, slides in ((math.atan(friction) - 0.08, False), (math.atan(friction) + 0.08, True)):
        c, s = math.cos(angle), math.sin(angle)
        rotation = [math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0]
        slope = body(shape="plane", size_m=[], position_m=[0.0, 0.0, 0.5], rotation_wxyz=rotation, friction=friction)
        start = np.array([0.02 * s, 0.0, 0.5 + 0.02 * c])
        block = _free("block", "box", [0.1, 0.1, 0.04], start.tolist(), rotation_wxyz=rotation, friction=1.0)
        step, bodies = _world(slope, block)
        for _ in range(1000):
            step()
        moved = float((_place(bodies["block"]) - start) @ [c, 0.0, -s])
        acceleration = GRAVITY_M_S2 * (s - friction * c)
        assert moved == pytest.approx(acceleration / 2 if slides else 0.0, abs=0.05 * acceleration if slides else 2e-3)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9])
def test_a_ball_rebounds_as_the_product_of_both_restitutions_says(restitution):
    ball = _free("ball", "sphere", [0.02], [0.0, 0.0, 1.32], restitution=restitution)
    step, bodies = _world(body(restitution=1.0), ball)
    height, fallen = 0.0, False
    for _ in range(600):
        step()
        z = _place(bodies["ball"])[2] - 1.02
        fallen = fallen or z < 2e-3
        height = max(height, z) if fallen else 0.0
    assert height == pytest.approx(0.3 * restitution**2, abs=0.01)


def test_a_sprung_table_gives_way_by_the_weight_over_its_stiffness_and_carries_its_own():
    pad, block = body("soft_table"), _free("block", "box", [0.1, 0.1, 0.04], [0.0, 0.0, 1.02], mass_kg=2.0)
    for bodies, desired_m in (((pad,), 0.0), ((pad, block), 2.0 * GRAVITY_M_S2 / 5000.0)):
        step, made = _world(*bodies)
        for _ in range(1500):
            step()
        assert _place(made["table"]) == pytest.approx([0.0, 0.0, 0.98 - desired_m], abs=2e-5)


def test_a_turned_sprung_table_yields_against_the_weight_all_the_same():
    half = math.sin(math.pi / 6)
    step, made = _world(body("soft_table", rotation_wxyz=[math.cos(math.pi / 6), 0.0, half, 0.0]))
    for _ in range(500):
        step()
    assert _place(made["table"]) == pytest.approx([0.0, 0.0, 0.98], abs=1e-9)


@pytest.mark.parametrize("ratio", [0.1, 1.0, 3.0])
def test_springs_as_stiff_as_allowed_come_to_rest_and_stiffer_ones_are_refused(ratio):
    maximum = 2.0 * ((math.hypot(ratio, 1.0) - ratio) / STEP_S) ** 2
    pad = body("soft_table", damping_ratio=ratio, stiffness_n_m=0.999 * maximum)
    step, bodies = _world(pad, _free("ball", "sphere", [0.02], [0.0, 0.0, 1.05]))
    for _ in range(1500):
        step()
    assert _place(bodies["table"])[2] == pytest.approx(0.98 - 0.4 * GRAVITY_M_S2 / maximum, rel=1e-5)
    message = (
        rf"'scene\.bodies\[0\]\.stiffness_n_m' is {1.001 * maximum}.* for table of 2\.0 kg; allowed: up to .* at steps"
    )
    with pytest.raises(ConfigError, match=message):
        _world(pad | {"stiffness_n_m": 1.001 * maximum})


def test_a_point_is_as_deep_in_a_body_as_the_nearest_face_says():
    turned = [math.cos(math.pi / 4), 0.0, math.sin(math.pi / 4), 0.0]  # z onto x
    (box, cylinder, sphere, plane) = scene(
        _named("box", size_m=[0.2, 0.4, 0.6], position_m=[1, 0, 0], rotation_wxyz=turned),
        _named("cylinder", shape="cylinder", size_m=[0.1, 0.4], position_m=[0, 0, 0]),
        _named("sphere", shape="sphere", size_m=[0.3], position_m=[0, 1, 0]),
        _named("plane", shape="plane", size_m=[], position_m=[0, 0, 2], rotation_wxyz=turned),
    ).bodies
    for one, point, depth in (
        (box, [1.0, 0.0, 0.0], 0.1),
        (box, [1.28, 0.0, 0.0], 0.02),
        (box, [1.4, 0.0, 0.0], -0.1),
        (box, [1.33, 0.0, 0.14], -0.05),
        (cylinder, [0.06, 0.0, 0.0], 0.04),
        (cylinder, [0.0, 0.0, 0.19], 0.01),
        (cylinder, [0.13, 0.0, 0.24], -0.05),
        (sphere, [0.0, 0.8, 0.0], 0.1),
        (sphere, [0.0, 2.0, 0.0], -0.7),
        (plane, [-0.2, 5.0, 0.0], 0.2),
        (plane, [0.1, 0.0, 9.0], -0.1),
    ):
        assert depth_m(one, np.array(point)) == pytest.approx(depth, abs=1e-9)


def test_a_body_that_holds_the_arms_base_or_its_tool_is_named():
    clear, foot = np.array([[1.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.9]])
    tool = np.array([0.5, 0.0, 1.2])
    check_clear(scene(body()), clear, tool, 0.02)
    check_clear(scene(body(position_m=[0.0, 0.0, 0.88])), foot, tool, 0.02)  # it may stand on it
    with pytest.raises(
        ConfigError,
        match=r"'scene\.bodies\[0\]' \(table\) overlaps with the arm's base by 20 mm at \[0\.000, 0\.000, 1\.000\] m; "
        r"move the body, or the arm \(robot\.base_position_m, robot\.home_rad\)",
    ):
        check_clear(scene(body(position_m=[0.0, 0.0, 1.0])), foot, tool, 0.02)
    with pytest.raises(ConfigError, match=r"\(table\) overlaps with the tool at home by 15 mm"):
        check_clear(scene(body(position_m=[0.5, 0.0, 1.165])), clear, tool, 0.03)


def test_a_reset_puts_every_body_back_and_the_same_happens_again():
    world, added = dartpy.simulation.World(), []
    world.setTimeStep(STEP_S)
    world.getConstraintSolver().setCollisionDetector(dartpy.collision.BulletCollisionDetector())
    made = Scene(world, scene(body("soft_table"), _free("block", "box", [0.1, 0.1, 0.04], [0.1, 0.0, 1.1])))
    for _ in range(2):
        made.reset()
        path = []
        for _ in range(400):
            made.pull()
            world.step()
            path.append([_place(one).tolist() for one in made.bodies.values()])
        added.append(path)
    assert added[0] == added[1]
    assert added[0][-1][1][2] < 1.05
