from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.errors import SimulationError
from kendama_cli.physics.rope import RopeLaw, rope_pull
from kendama_cli.simulation.dart.arm_errors import NO_ERRORS, WorldErrors
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld
from tests.simulation.dart.bench_robot import bench_arm, frictionless_bench_arm, kendama_game

STILL = np.zeros(7)


def _sway(world: ArmWorld, steps: int) -> list[list[float]]:
    home, seen = world.arm.home_rad, []
    for k in range(1, steps + 1):
        t = k * STEP_S
        world.step(home + 0.05 * (1 - math.cos(6 * t)), 0.3 * math.sin(6 * t) + STILL, 1.8 * math.cos(6 * t) + STILL)
        seen.append([*world.ball.position_m, *world.ball.tie_m, *world.ball.tie_m_s, *np.ravel(_axis(world))])
    return seen


def _axis(world: ArmWorld) -> tuple[np.ndarray, np.ndarray]:
    """The cup's axis in the world and its rate."""
    cup = world.body.cup
    axis = cup.getWorldTransform().rotation()[:, 2]
    return axis, np.cross(cup.getAngularVelocity(), axis)


def _hold(world: ArmWorld, steps: int) -> None:
    for _ in range(steps):
        world.step(world.arm.home_rad, STILL, STILL)


def test_the_home_posture_holds_the_cup_upright_over_the_origin() -> None:
    world = ArmWorld(bench_arm(), kendama_game())
    value, _ = world.arm.cup_task(world.arm.home_rad)
    assert np.abs(value[:2]).max() < 1e-5
    assert value[2] == pytest.approx(1.2, abs=1e-5)
    assert np.abs(value[3:]).max() < 1e-5


def test_dart_moves_the_ball_as_semi_implicit_euler_does() -> None:
    game = kendama_game()
    world = ArmWorld(bench_arm(), game)
    world.perturb(WorldErrors(ball_start_m=0.25))
    world.reset(world.arm.home_rad)
    law, (linear, quadratic) = RopeLaw.of(game), game.drag
    world.ball.put(world.ball.position_m, [1.0, 0.3, 3.0])
    ball, speed = np.array(world.ball.position_m), np.array(world.ball.velocity_m_s)
    tie, tie_speed = np.array(world.ball.tie_m), np.array(world.ball.tie_m_s)
    axis, axis_rate = _axis(world)
    slack = taut = around = 0
    for seen in _sway(world, 3000):
        rope = rope_pull(law, tuple(ball - tie), tuple(speed - tie_speed), tuple(axis), tuple(axis_rate))
        taut, slack = taut + (rope.tension_n > 0.0), slack + (rope.tension_n == 0.0)
        around += rope.tension_n > 0.0 and rope.pivot_m != (0.0, 0.0, 0.0)
        drag = linear + quadratic * np.linalg.norm(speed)
        tension = np.array(rope.force_n) - drag * speed
        speed = speed + STEP_S * (tension / game.ball.mass_kg - [0, 0, game.gravity_m_s2])
        ball = ball + STEP_S * speed
        assert np.abs(ball - seen[:3]).max() < 2e-12, "measured: 1.01e-12 after 3000 steps"
        tie, tie_speed, axis, axis_rate = seen[3:6], seen[6:9], seen[9:12], seen[12:]
    assert taut > 100
    assert slack > 100
    assert around > 10


def test_the_arm_carries_the_weight_of_the_hanging_ball() -> None:
    """Newton's third law: at rest the joints bear J^T (0, 0, m g) more under a ball that is heavier by m."""
    game = kendama_game()
    light = dataclasses.replace(game, ball=dataclasses.replace(game.ball, mass_kg=0.02))
    efforts = []
    for each in (game, light):
        world = ArmWorld(frictionless_bench_arm(), each)
        for _ in range(3000):
            world.step(world.arm.home_rad, STILL, STILL)
        efforts.append(world.effort_nm)
    _, jacobian = world.arm.cup_task(world.position_rad)
    weight = (game.ball.mass_kg - 0.02) * game.gravity_m_s2
    # the arm sags by 1e-4 rad under the load, which changes the gravity terms by about 1e-3 Nm
    assert efforts[0] - efforts[1] == pytest.approx(jacobian[2] * weight, abs=5e-3)
    assert np.abs(jacobian[2] * weight).max() > 0.1


def test_a_ball_that_runs_away_stops_the_simulation() -> None:
    game = kendama_game()
    stiff = dataclasses.replace(game, rope=dataclasses.replace(game.rope, stiffness_n_m=1e7))
    world = ArmWorld(bench_arm(), stiff)
    world.perturb(WorldErrors(ball_start_m=0.1))
    world.reset(world.arm.home_rad)
    with pytest.raises(SimulationError, match=r"the ball .* at 0\.\d+ s: .*game\.rope") as caught:
        _hold(world, 3000)
    assert caught.value.quantity == "ball"


def test_efforts_and_positions_keep_to_their_limits_whatever_is_asked() -> None:
    world = ArmWorld(bench_arm(), kendama_game())
    for sign in (1.0, -1.0):
        for _ in range(1500):
            world.step(world.arm.home_rad + 8.0 * sign, STILL, STILL)
            assert (np.abs(world.effort_nm) <= world.arm.limits.effort_nm).all()
        # DART's joint stops let a joint in by what one step at its speed limit covers
        maximum = world.arm.limits.velocity_rad_s * STEP_S + 1e-3
        assert (world.position_rad <= world.arm.limits.upper_rad + maximum).all()
        assert (world.position_rad >= world.arm.limits.lower_rad - maximum).all()


@pytest.mark.parametrize("joint", range(7))
def test_a_joint_that_is_driven_into_its_stop_stays_there(joint: int) -> None:
    """Full torque past a drive that does not ask for it: what a wrong feedforward would do."""
    world = ArmWorld(bench_arm(), kendama_game())
    push = np.zeros(7)
    push[joint] = 1e9
    for _ in range(3500):
        world.step(world.position_rad, STILL, STILL, feedforward_nm=push)
        assert world.effort_nm[joint] == world.arm.limits.effort_nm[joint]
        maximum = world.arm.limits.velocity_rad_s * STEP_S + 1e-3
        assert (world.position_rad <= world.arm.limits.upper_rad + maximum).all()
    assert world.position_rad[joint] == pytest.approx(world.arm.limits.upper_rad[joint], abs=1e-2)
    assert abs(world.velocity_rad_s[joint]) < 1e-2


def test_speeds_keep_to_their_limits_under_any_reference() -> None:
    world = ArmWorld(bench_arm(), kendama_game())
    fastest = np.zeros(7)
    for _ in range(800):
        world.step(world.arm.home_rad + 1.0, STILL + 50.0, STILL)
        fastest = np.maximum(fastest, np.abs(world.velocity_rad_s))
    fraction = fastest / world.arm.limits.velocity_rad_s
    assert fraction.max() > 0.9
    # the reference keeps to the limits exactly; with motors at their torque limits the loop swings, and DART holds a
    # joint at its top speed one step late
    assert (fraction < 1.1).all()


def test_accelerations_keep_to_their_limits_under_a_jump_of_the_reference() -> None:
    world = ArmWorld(frictionless_bench_arm(), kendama_game())
    speeds, jump = [world.velocity_rad_s], np.array([0.0, 0.0, 0.0, 0.0, 0.2, 0.2, 0.2])
    for _ in range(300):
        world.step(world.arm.home_rad + jump, STILL, STILL)
        assert (np.abs(world.effort_nm) < world.arm.limits.effort_nm).all()
        speeds.append(world.velocity_rad_s)
    fraction = np.abs(np.diff(speeds, axis=0)).max(axis=0) / STEP_S / world.arm.limits.acceleration_rad_s2
    assert (fraction[4:] > 0.9).all()
    assert (fraction < 1.05).all()  # the ball's pull, which the controller does not know
    # without the drive the same jump would ask for this much
    assert 0.2 * world.arm.settings.stiffness_1_s2 > 5 * world.arm.limits.acceleration_rad_s2.max()


def test_the_arm_follows_within_what_the_ball_s_pull_costs() -> None:
    """Nothing leads or lags: with a rope that does not pull the discrete loop is exact but for the start."""
    game = kendama_game()
    limp = dataclasses.replace(game, rope=dataclasses.replace(game.rope, stiffness_n_m=1e-6, damping_n_s_m=0.0))
    worst = {}
    for name, each in (("ball", game), ("none", limp)):
        world = ArmWorld(frictionless_bench_arm(), each)
        world.ball.put([world.ball.tie_m[0], world.ball.tie_m[1], world.ball.tie_m[2] - 0.4], [0.0, 0.0, 0.0])
        errors = []
        for k in range(1, 1500):
            t = k * STEP_S
            reference = world.arm.home_rad + 0.05 * (1 - math.cos(6 * t))
            world.step(reference, STILL + 0.3 * math.sin(6 * t), STILL + 1.8 * math.cos(6 * t))
            errors.append(np.abs(world.position_rad - reference).max())
        worst[name] = max(errors[500:])
    assert worst["none"] < 2e-5
    assert worst["ball"] < 2e-3


def test_a_jump_that_the_drive_tames_is_told() -> None:
    world = ArmWorld(bench_arm(), kendama_game())
    _sway(world, 20)
    assert not world.limited
    world.step(world.arm.home_rad + 0.2, STILL, STILL)
    assert world.limited


def test_feedforward_is_added_to_the_torque_and_clipped_with_it() -> None:
    plain, pushed = ArmWorld(bench_arm(), kendama_game()), ArmWorld(bench_arm(), kendama_game())
    extra = np.array([1.0, -2.0, 0.5, 0.0, 0.1, 0.2, -0.3])
    plain.step(plain.arm.home_rad, STILL, STILL)
    pushed.step(pushed.arm.home_rad, STILL, STILL, feedforward_nm=extra)
    assert pushed.effort_nm - plain.effort_nm == pytest.approx(extra, abs=1e-9)
    pushed.step(pushed.arm.home_rad, STILL, STILL, feedforward_nm=STILL + 1e6)
    assert (pushed.effort_nm == pushed.arm.limits.effort_nm).all()


def test_a_feedforward_that_is_not_finite_stops_the_simulation() -> None:
    world = ArmWorld(bench_arm(), kendama_game())
    with pytest.raises(SimulationError, match=r"the torque of joint 's2' of pa10 is inf at 0\.000 s"):
        world.step(world.arm.home_rad, STILL, STILL, feedforward_nm=np.array([0, np.inf, 0, 0, 0, 0, 0.0]))


@pytest.mark.parametrize("restitution", [0.1, 0.6])
def test_a_ball_leaves_the_cup_s_floor_with_the_share_of_its_speed_that_restitution_says(restitution: float) -> None:
    world = ArmWorld(bench_arm(), kendama_game())
    world.perturb(WorldErrors(restitution=restitution))
    world.reset(world.arm.home_rad)
    x, y, z = world.ball.tie_m
    world.ball.put([x, y, z + 0.1], [0.0, 0.0, -1.5])
    before = after = 0.0
    for _ in range(200):
        _hold(world, 1)
        speed = world.ball.velocity_m_s[2] - world.ball.tie_m_s[2]
        before, after = min(before, speed), max(after, speed)
    assert after / -before == pytest.approx(restitution, abs=0.02)


def test_a_torque_that_is_not_finite_stops_the_simulation_and_names_the_joint() -> None:
    world = ArmWorld(bench_arm(), kendama_game())
    reference = world.arm.home_rad.copy()
    reference[3] = np.nan
    with pytest.raises(SimulationError, match=r"joint 'e1' of pa10 is nan at 0\.000 s") as caught:
        world.step(reference, STILL, STILL)
    assert caught.value.quantity == "e1"


def test_what_happened_before_a_reset_changes_nothing() -> None:
    world, other = ArmWorld(bench_arm(), kendama_game()), ArmWorld(bench_arm(), kendama_game())
    first = _sway(world, 400)
    world.perturb(WorldErrors(rope_scale=1.01, ball_start_m=0.1, joint_friction_nm=1.0))
    world.reset(world.arm.home_rad + 0.1)
    _sway(world, 300)
    world.perturb(NO_ERRORS)
    world.reset(world.arm.home_rad)
    assert _sway(world, 400) == first == _sway(other, 400)


def test_a_ball_dropped_into_the_cup_stays_and_is_caught() -> None:
    game = kendama_game()
    world = ArmWorld(bench_arm(), game)
    x, y, z = world.ball.tie_m
    assert not world.ball.is_in_cup()
    for lateral, down_m_s in ((0.0, 0.0), (0.02, 4.0), (-0.024, 2.0)):
        world.reset(world.arm.home_rad)
        world.ball.put([x + lateral, y, z + 0.12], [0.0, 0.0, -down_m_s])
        for _ in range(1500):
            world.step(world.arm.home_rad, STILL, STILL)
        assert world.ball.is_in_cup()


def test_a_ball_dropped_beside_the_cup_is_not_caught() -> None:
    world = ArmWorld(bench_arm(), kendama_game())
    x, y, z = world.ball.tie_m
    world.ball.put([x + 0.075, y, z + 0.12], [0.0, 0.0, 0.0])
    for _ in range(1500):
        world.step(world.arm.home_rad, STILL, STILL)
    assert not world.ball.is_in_cup()
    assert world.ball.position_m[2] < z


def test_friction_that_the_controller_does_not_know_costs_accuracy() -> None:
    worst = []
    for friction in (0.0, 5.0):
        world = ArmWorld(bench_arm(), kendama_game())
        world.perturb(WorldErrors(joint_friction_nm=friction))
        world.reset(world.arm.home_rad)
        _sway(world, 500)
        worst.append(float(np.abs(world.position_rad - world.arm.home_rad - 0.05 * (1 - math.cos(3.0))).max()))
    assert worst[1] > 3 * worst[0]


def test_a_cup_on_an_arm_recoils_from_a_ball_by_the_impulse_over_its_inertia_at_the_contact() -> None:
    """Newton's restitution is exact between ball and cup; M = 1 / (J H^-1 J^T) along z, H with DART's rotors."""
    world, restitution = ArmWorld(bench_arm(), kendama_game()), 0.6
    world.perturb(WorldErrors(restitution=restitution))
    world.reset(world.arm.home_rad)
    over_m = np.array([0.0, 0.0, world.ball.game.cup.rim_m + 0.25])
    world.ball.put((world.ball.tie_m + over_m).tolist(), (0.0, 0.0, 0.0))
    ball, cup = [0.0], [0.0]
    while ball[-1] <= 0.0:
        _hold(world, 1)
        ball.append(float(world.ball.velocity_m_s[2]))
        cup.append(float(world.ball.tie_m_s[2]))
    assert (ball[-1] - cup[-1]) / (cup[-2] - ball[-2]) == pytest.approx(restitution, abs=0.01)
    along = world.arm.tool_jacobian(world.arm.home_rad)[2]
    inertia_kg = 1.0 / float(along @ np.linalg.solve(world.body.skeleton.getMassMatrix(), along))
    impulse = world.ball.mass_kg * (ball[-1] - ball[-2])
    assert cup[-1] - cup[-2] == pytest.approx(-impulse / inertia_kg, rel=0.05)
    assert inertia_kg == pytest.approx(0.55, abs=0.02)
    height_m = world.ball.position_m[2] - world.ball.tie_m[2] - world.ball.game.cup.rim_m
    rises_m = [height_m + one**2 / (2 * world.ball.game.gravity_m_s2) for one in (ball[-1], restitution * -ball[-2])]
    assert rises_m == pytest.approx([0.018, 0.061], abs=0.002)
