from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.arm_errors import (
    ONSET_S,
    ArmErrors,
    Backlash,
    ElasticJoints,
    ErringArm,
    WorldErrors,
    _joint_offsets,
)
from kendama_cli.simulation.dart.rollout import play_rollout
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld
from tests.simulation.dart.bench_robot import bench_arm, kendama_game, modelled


def _held(seconds: float) -> JointTrajectory:
    arm = modelled(bench_arm())
    t_s = STEP_S * np.arange(round(seconds / STEP_S) + 1)
    still = np.zeros((len(t_s), len(arm.joint_names)))
    return JointTrajectory(arm.joint_names, t_s, still + arm.home_rad, still, still)


def _followed(joints: JointTrajectory, errors: ArmErrors) -> Array:
    erring = ErringArm(modelled(bench_arm()), joints, errors, STEP_S)
    made = [
        erring.follows(joints.position_rad[k], joints.velocity_rad_s[k], joints.acceleration_rad_s2[k])
        for k in range(len(joints.t_s))
    ]
    return np.array([one[0] for one in made])


@pytest.mark.parametrize(("top_rad_s2", "cup_error_hz"), [(None, 1.6), (None, 5.0), (0.2, 5.0)])
def test_the_cup_errs_by_a_sine_along_x_whatever_the_drive_allows(
    top_rad_s2: float | None, cup_error_hz: float
) -> None:
    """An error is no command: with 5 mm at 5 Hz the joints go faster by more than the 0.2 rad/s^2 of the last case.

    J^+ is exact to first order. Dry friction is left out: it is compensated for the speed that is wanted, here none.
    """
    none = (0.0,) * 7
    robot, joints = dataclasses.replace(bench_arm(), coulomb_nm=none, stribeck_nm=none), _held(1.0)
    if top_rad_s2 is not None:
        robot = dataclasses.replace(robot, acceleration_rad_s2=(top_rad_s2,) * 7)
    world = ArmWorld(robot, kendama_game())
    errors = ArmErrors(cup_error_m=0.005, cup_error_hz=cup_error_hz, cup_error_phase_rad=0.4)
    made = play_rollout(world, joints, errors=errors, record=True)
    assert made.trace is not None
    moved = made.trace.cup_m - made.trace.cup_m[0]
    late = made.trace.t_s >= ONSET_S
    desired = 0.005 * np.sin(2 * np.pi * cup_error_hz * made.trace.t_s + 0.4)
    assert moved[late, 0] == pytest.approx(desired[late], abs=1e-4)
    assert np.abs(moved[:, 1:]).max() < 3e-4
    assert np.abs(moved[1]).max() < 1e-4


def test_the_cup_errs_along_y_by_a_sine_of_its_own() -> None:
    none = (0.0,) * 7
    world = ArmWorld(dataclasses.replace(bench_arm(), coulomb_nm=none, stribeck_nm=none), kendama_game())
    errors = ArmErrors(cup_error_y_m=0.005, cup_error_y_hz=2.0, cup_error_y_phase_rad=1.0)
    made = play_rollout(world, _held(1.0), errors=errors, record=True)
    assert made.trace is not None
    moved = made.trace.cup_m - made.trace.cup_m[0]
    late = made.trace.t_s >= ONSET_S
    desired = 0.005 * np.sin(2 * np.pi * 2.0 * made.trace.t_s + 1.0)
    assert moved[late, 1] == pytest.approx(desired[late], abs=1e-4)
    assert np.abs(moved[:, [0, 2]]).max() < 3e-4


class _Reader:
    """Steers nothing, and keeps what it is given to read."""

    steps = 1

    def __init__(self) -> None:
        self.read_rad: list[Array] = []

    def coming(self, t_s: float, position_rad: Array, ball_m: Array) -> None:
        self.read_rad.append(position_rad)


def test_the_arm_does_not_know_that_it_errs() -> None:
    """What catches a ball reads the angles as the drive does: at 0.5 Hz the cup seems to be where it should be."""
    world, joints, reader = ArmWorld(bench_arm(), kendama_game()), _held(1.5), _Reader()
    errors = ArmErrors(cup_error_m=0.005, cup_error_hz=0.5)
    made = play_rollout(world, joints, errors=errors, correction=reader, record=True)
    assert made.trace is not None
    read = np.array([world.arm.tool_position_m(q) for q in reader.read_rad]) - world.arm.tool_position_m(
        joints.position_rad[0]
    )
    late = len(read) // 2
    assert np.abs(made.trace.cup_m - made.trace.cup_m[0])[:, 0].max() > 0.0045
    assert np.abs(read[late:, 0]).max() < 0.001


def test_a_lagging_arm_is_late_by_its_lag_on_a_steady_motion() -> None:
    joints = _held(1.0)
    speed = np.zeros(len(joints.joint_names))
    speed[3] = 0.2
    steady = dataclasses.replace(
        joints,
        position_rad=joints.position_rad + np.outer(joints.t_s, speed),
        velocity_rad_s=joints.velocity_rad_s + speed,
    )
    positions = _followed(steady, ArmErrors(lag_s=0.03))
    late_s = (steady.position_rad[-1, 3] - positions[-1, 3]) / 0.2
    # the discrete lag, h / (e^(h / T) - 1) is half a step short of T
    assert late_s == pytest.approx(0.03 - STEP_S / 2, abs=1e-5)


def test_an_arm_without_errors_follows_what_it_is_told() -> None:
    joints = _held(0.1)
    assert _followed(joints, ArmErrors()) == pytest.approx(joints.position_rad, abs=0)


def test_a_heavier_ball_pulls_harder_and_thicker_air_slows_more() -> None:
    world = ArmWorld(bench_arm(), kendama_game())
    game = kendama_game()
    for mass, drag in ((1.1, 1.0), (1.0, 3.0)):
        world.perturb(WorldErrors(mass_scale=mass, drag_scale=drag))
        world.reset(world.arm.home_rad)
        zero = np.zeros(len(world.arm.joint_names))
        for _ in range(200):
            world.step(world.arm.home_rad, zero, zero)
        weight_n = mass * game.ball.mass_kg * game.gravity_m_s2
        assert world.ball.tension_n == pytest.approx(weight_n, rel=1e-3)
        assert world.ball.skeleton.getMass() == pytest.approx(mass * game.ball.mass_kg)
        world.ball.put(world.ball.tie_m + np.array([0.1, 0.0, 0.2]), (2.0, 0.0, 0.0))
        world.ball.pull(0.0)
        k1, k2 = game.drag
        assert world.ball.drag_n[0] == pytest.approx(-drag * (k1 + 2.0 * k2) * 2.0, rel=1e-9)


def test_a_joint_with_backlash_rests_until_its_motor_has_crossed_the_play() -> None:
    play = Backlash(np.zeros(1), 0.002)
    motor = np.concatenate([np.linspace(0, 0.01, 101), np.linspace(0.01, 0, 101)])
    made = [play.follows(np.array([one]), np.ones(1), np.ones(1)) for one in motor]
    link = np.array([float(one[0][0]) for one in made])
    assert link[100] == pytest.approx(0.009)
    assert link[-1] == pytest.approx(0.001)
    resting = np.diff(link) == 0
    assert resting.sum() == pytest.approx(10 + 20 + 1, abs=2)  # half the play at first, all of it at the turn
    assert all((float(one[1][0]) == 0.0) == rests for one, rests in zip(made[1:], resting, strict=True))


def test_in_leaning_gravity_the_ball_hangs_aside_and_stays_there() -> None:
    world = ArmWorld(bench_arm(), kendama_game())
    world.perturb(WorldErrors(gravity_tilt_rad=0.01745))
    world.reset(world.arm.home_rad)
    zero = np.zeros(len(world.arm.joint_names))
    lateral = kendama_game().rope.length_m * np.sin(0.01745)
    for _ in range(400):
        world.step(world.arm.home_rad, zero, zero)
        assert world.ball.position_m[0] - world.ball.tie_m[0] == pytest.approx(lateral, abs=1e-4)


def test_gravity_that_leans_to_both_sides_and_a_start_beside_it_add_up() -> None:
    """The ball rests where the vector of gravity points, and starts beside that by as much as is asked for."""
    world, zero = ArmWorld(bench_arm(), kendama_game()), np.zeros(7)
    length = kendama_game().rope.length_m
    world.perturb(WorldErrors(gravity_tilt_rad=0.01, gravity_tilt_y_rad=-0.02))
    world.reset(world.arm.home_rad)
    for _ in range(400):
        world.step(world.arm.home_rad, zero, zero)
        hangs = (world.ball.position_m - world.ball.tie_m)[:2]
        assert hangs == pytest.approx([length * np.sin(0.01), -length * np.sin(0.02)], abs=1e-4)
    world.perturb(WorldErrors(gravity_tilt_y_rad=-0.02, ball_start_y_m=0.05))
    world.reset(world.arm.home_rad)
    hangs = (world.ball.position_m - world.ball.tie_m)[:2]
    assert hangs == pytest.approx([0.0, 0.05 - length * np.sin(0.02)], abs=1e-4)


@pytest.mark.parametrize("scale", [0.2, 2.0])
def test_scaled_rotors_of_the_wrist_are_those_of_an_arm_that_is_described_so(scale: float) -> None:
    """A ball falls on the rim; what is scaled once is as it was after that."""
    rotors = bench_arm().rotor_inertia_kg_m2
    assert rotors is not None
    described = (*rotors[:-3], *(scale * one for one in rotors[-3:]))
    other = ArmWorld(dataclasses.replace(bench_arm(), rotor_inertia_kg_m2=described), kendama_game())
    world = ArmWorld(bench_arm(), kendama_game())
    nominal = _struck(world)
    world.perturb(WorldErrors(wrist_rotor_scale=scale))
    scaled = _struck(world)
    assert scaled.tobytes() == _struck(other).tobytes()
    assert np.abs(scaled - nominal).max() > 1e-6
    world.perturb(WorldErrors())
    assert _struck(world).tobytes() == nominal.tobytes()


def _struck(world: ArmWorld) -> Array:
    """Return the arm's angles after a ball has fallen on the cup's rim."""
    world.reset(world.arm.home_rad)
    zero = np.zeros(7)
    rim_m = np.array([world.ball.game.cup.radius_m, 0.0, world.ball.game.cup.rim_m + 0.03])
    world.ball.put((world.ball.tie_m + rim_m).tolist(), (0.0, 0.0, -2.0))
    for _ in range(40):
        world.step(world.arm.home_rad, zero, zero)
    return world.position_rad


def test_friction_at_the_tie_takes_what_it_should_from_a_swing() -> None:
    """A small swing loses 4 mu r per period of its amplitude along the arc: M = mu r T over the length, T about m g."""
    world, zero = ArmWorld(bench_arm(), kendama_game()), np.zeros(7)
    amplitudes = []
    for friction_m in (0.0, 0.002):
        world.perturb(WorldErrors(ball_start_m=0.1, tie_friction_m=friction_m, drag_scale=1e-6))
        world.reset(world.arm.home_rad)
        positions = []
        for _ in range(1400):
            world.step(world.arm.home_rad, zero, zero)
            positions.append(float(world.ball.position_m[0] - world.ball.tie_m[0]))
        amplitudes.append(max(positions[1000:]))
    assert amplitudes[0] - amplitudes[1] == pytest.approx(4 * 0.002, rel=0.15)


def test_the_cup_errs_by_the_jacobian_and_angles_are_misread_by_as_much_as_makes_the_arm_err_so() -> None:
    """J dq = e at each knot of 20 ms, e grown from nothing; dq'' + Kd dq' + Kp (dq + m) = 0, m the reading error."""
    arm, held = modelled(bench_arm()), _held(0.8)
    sway = np.outer(np.sin(3 * held.t_s), np.linspace(0.1, 0.3, 7))
    joints = dataclasses.replace(held, t_s=held.t_s + 2.0, position_rad=held.position_rad + sway)
    errors = ArmErrors(
        cup_error_m=0.004, cup_error_hz=1.3, cup_error_phase_rad=0.4, cup_error_y_m=0.003, cup_error_y_hz=2.1,
        cup_error_y_phase_rad=-1.0, resonance_hz=8.0,
    )  # fmt: skip
    offset, rate, change = _joint_offsets(arm, joints, errors)
    t_s = STEP_S * np.arange(len(held.t_s))
    u = np.minimum(t_s / ONSET_S, 1.0)
    grown = 10 * u**3 - 15 * u**4 + 6 * u**5
    along = 0.004 * grown * np.sin(2 * np.pi * 1.3 * t_s + 0.4)
    across = 0.003 * grown * np.sin(2 * np.pi * 2.1 * t_s - 1.0)
    for k in range(0, len(t_s), 20):
        moved = arm.tool_jacobian(joints.position_rad[k]) @ offset[k]
        assert moved == pytest.approx([along[k], across[k], 0.0, 0.0, 0.0, 0.0], abs=1e-9)
        cost = np.linalg.norm(np.sqrt(arm.redundancy_weights) * offset[k])
        freer = np.linalg.svd(arm.tool_jacobian(joints.position_rad[k]))[2][6]
        for side in (-1e-3, 1e-3):
            assert np.linalg.norm(np.sqrt(arm.redundancy_weights) * (offset[k] + side * freer)) >= cost - 1e-9
    assert rate[1:-1] == pytest.approx((offset[2:] - offset[:-2]) / (2 * STEP_S), abs=2e-4)
    assert change[1:-1] == pytest.approx(np.diff(offset, 2, axis=0) / STEP_S**2, abs=2e-2)
    erring, stiff = ErringArm(arm, joints, errors, STEP_S), arm.settings.stiffness_1_s2
    links = ElasticJoints(7, 8.0, errors.resonance_damping, STEP_S)
    motors = np.random.default_rng(1).normal(size=(len(t_s), 7))
    for k in range(1, 60):
        seen = erring.encoder_error(k)
        swung, swung_rate, swung_change = links.swung(motors[k])
        for dq, dv, da, found in (
            (
                offset[k - 1] + swung,
                rate[k - 1] + swung_rate,
                change[k - 1] + swung_change,
                erring.reading_error(k, motors[k]),
            ),
            (offset[k - 1], rate[k - 1], change[k - 1], seen + swung),
        ):
            assert da + 2 * np.sqrt(stiff) * dv + stiff * (dq + found) == pytest.approx(np.zeros(7), abs=1e-8)
