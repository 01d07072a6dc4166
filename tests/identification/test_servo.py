"""The servo from one motion: lags that were simulated by hand, and the twin's drive."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from scipy.signal import lfilter

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.control.imitation import Played, play_motion
from kendama_cli.devices.robot.leading import LeadingRobot
from kendama_cli.devices.robot.simulated import SimulatedRobot
from kendama_cli.errors import StageError
from kendama_cli.identification.servo import (
    _deviation,
    _Fit,
    _Motion,
    _rest_s,
    _solved,
    cup_sag_m,
    fit_servo,
    followed,
    servo_changed,
    servo_of,
)
from kendama_cli.robot_model.model import RobotModel
from tests.control.test_rope_fit import swing
from tests.stages.transfer_setup import GAME, ROBOT, TWIN

ARM = RobotModel(ROBOT, GAME.cup, GAME.gravity_m_s2)
PERIOD_S = 0.004


def found(arm: RobotModel, sent: np.ndarray, measured: np.ndarray, period_s: float) -> ServoModel:
    servo = fit_servo(arm, sent, measured, period_s)
    assert servo is not None
    return servo


def motion(seconds: float = 3.0) -> np.ndarray:
    """Commands (k, 7) of sines of 0.5 to 1.1 Hz about the home posture, from rest; the last two joints rest."""
    t_s = np.arange(round(seconds / PERIOD_S)) * PERIOD_S
    rates = np.array([0.5, 0.6, 0.7, 0.8, 1.1, 0.0, 0.0])
    return ARM.home_rad + 0.3 * (1.0 - np.cos(2 * np.pi * rates * t_s[:, None]))


def lagging(sent: np.ndarray, lag_s: float, dead_periods: int = 0) -> np.ndarray:
    """Angles of T q' + q = u(t - d), by steps a hundredth of a period long, u on straight lines between commands."""
    late = np.vstack([np.repeat(sent[:1], dead_periods, axis=0), sent])[: len(sent)]
    q, angles, steps = sent[0].copy(), [sent[0].copy()], 100
    for before, after in itertools.pairwise(late):
        for k in range(steps):
            u = before + (k + 0.5) / steps * (after - before)
            q = q + PERIOD_S / steps / lag_s * (u - q)
        angles.append(q.copy())
    return np.array(angles)


@pytest.mark.parametrize(("lag_s", "dead_periods"), [(0.03, 0), (0.12, 0), (0.1, 4)])
def test_lag_and_dead_time_are_found_through_the_encoders_noise(lag_s: float, dead_periods: int) -> None:
    sent = motion()
    measured = lagging(sent, lag_s, dead_periods) + np.random.default_rng(4).normal(0.0, 1e-4, sent.shape)
    servo = found(ARM, sent, measured, PERIOD_S)
    # a miss of 3 % of the lag still catches at 120 ms (shared figures of the prototype)
    assert servo.lag_s[:5] == pytest.approx(lag_s, rel=0.03)
    assert servo.dead_time_s == pytest.approx(dead_periods * PERIOD_S, abs=1.01 * PERIOD_S)
    assert servo.lag_s[5:] == pytest.approx(np.median(servo.lag_s[:5])), "joints at rest take the others' lag"


def test_the_motion_that_a_servo_makes_of_commands_is_told_beforehand() -> None:
    """Dead time and lag by hand; at rest, before anything moves, the arm sags as its weight says."""
    angles, none, compliance = motion(), np.zeros(7), 4e-4
    t_s = np.arange(len(angles)) * PERIOD_S
    velocity = np.gradient(angles, PERIOD_S, axis=0)
    commands = JointTrajectory(ARM.joint_names, t_s, angles, velocity, np.gradient(velocity, PERIOD_S, axis=0))
    late = followed(ARM, commands, ServoModel(ARM.joint_names, 2 * PERIOD_S, none + 0.05, none, none, none))
    assert late.position_rad == pytest.approx(lagging(angles, 0.05, 2), abs=4.2e-3)  # half a period at 2.1 rad/s
    assert np.abs(late.position_rad - angles).max() > 0.09
    assert late.velocity_rad_s == pytest.approx(np.gradient(late.position_rad, PERIOD_S, axis=0))
    rest, still = np.repeat(angles[:1], 9, axis=0), np.zeros((9, 7))
    resting = JointTrajectory(ARM.joint_names, t_s[:9], rest, still, still)
    sagging = followed(ARM, resting, ServoModel(ARM.joint_names, 0.0, none, none, none + compliance, none + 0.01))
    weight_nm = ARM.rigid_effort_nm(angles[0], none, none)
    assert sagging.position_rad[-1] == pytest.approx(angles[0] - compliance * weight_nm - 0.01)


def test_an_arm_that_follows_is_left_alone() -> None:
    sent = motion()
    measured = sent + np.random.default_rng(5).normal(0.0, 2e-4, sent.shape)
    assert found(ARM, sent, measured, PERIOD_S).follows


def test_sag_under_the_arms_weight_is_found_beside_the_lag() -> None:
    sent, compliance = motion(), 4e-4
    weight = np.array([ARM.rigid_effort_nm(q, np.zeros(7), np.zeros(7)) for q in sent])
    assert np.ptp(weight[:, 1]) > 20.0, "the second joint feels the weight change"
    servo = found(ARM, sent + compliance * _torques(lagging(sent, 0.05)), lagging(sent, 0.05), PERIOD_S)
    assert servo.lag_s[1] == pytest.approx(0.05, rel=0.03)
    assert servo.sag_rad_nm[1] == pytest.approx(compliance, rel=0.1)


def test_sag_is_found_through_the_noise_of_commands_that_are_held_for_a_period() -> None:
    sent, lag_s, compliance = motion(), 0.1, 4e-4
    angles = [sent[0]]
    for u in sent[1:]:
        angles.append(u + (angles[-1] - u) * np.exp(-PERIOD_S / lag_s))
    noise = np.random.default_rng(6).normal(0.0, 2e-4, sent.shape)
    servo = found(ARM, sent + compliance * _torques(np.array(angles)), np.array(angles) + noise, PERIOD_S)
    assert servo.dead_time_s == pytest.approx(-0.5 * PERIOD_S, abs=0.2 * PERIOD_S)
    assert servo.lag_s[:5] == pytest.approx(lag_s, rel=0.01)
    # least squares find 0.47 to 0.83 of it: the noise of the torques is as large as their change
    assert servo.sag_rad_nm[:4] == pytest.approx(compliance, rel=0.05)


def _torques(angles: np.ndarray) -> np.ndarray:
    velocity = np.gradient(angles, PERIOD_S, axis=0)
    change = np.gradient(velocity, PERIOD_S, axis=0)
    return np.array([ARM.rigid_effort_nm(*row) for row in zip(angles, velocity, change, strict=True)])


def test_a_motion_too_short_or_at_rest_tells_nothing() -> None:
    assert fit_servo(ARM, motion(0.1), motion(0.1), PERIOD_S) is None
    still = np.repeat(ARM.home_rad[None], 500, axis=0)
    assert fit_servo(ARM, still, still, PERIOD_S) is None


def test_a_delay_that_a_lag_does_not_explain_is_told_by_the_terms_of_velocity_and_acceleration() -> None:
    """u - q = (T + r) q' + (T r + r^2 / 2) q'' + s tau + c, made of random terms; the median of joints that moved."""
    rng, lag_s = np.random.default_rng(10020), 0.05
    motion = _Motion(*rng.normal(size=(4, 80, 4)))
    rest_s = np.array([0.012, -0.004, 0.011, 9.0])
    square = lag_s * rest_s + rest_s**2 / 2
    sent = motion.position + (lag_s + rest_s) * motion.velocity + square * motion.acceleration
    sent += 0.3 * motion.torque_nm + 0.1
    assert _rest_s(sent, motion, motion, np.array([True, True, True, False])) == pytest.approx(0.011)
    later = motion.after(0.02)
    assert later.velocity == pytest.approx(motion.velocity + 0.02 * motion.acceleration)
    assert later.position == pytest.approx(motion.position + 0.02 * motion.velocity + 0.0002 * motion.acceleration)


@pytest.mark.parametrize("rho", [0.0, 0.6])
def test_the_deviation_of_a_coefficient_is_its_scatter_over_many_motions(rho: float) -> None:
    """Residuals of a process of first order over slow terms; 300 fits scatter by 4 % of their own deviation."""
    rng = np.random.default_rng(10021)
    t = np.linspace(0, 20, 400)
    terms = np.column_stack([np.sin(0.7 * t), np.cos(1.1 * t), np.ones(400)])
    found = []
    for _ in range(300):
        noise = lfilter([1.0], [1.0, -rho], rng.normal(size=500))[100:]
        (first, *_), residual = _solved(terms, terms, terms @ [0.3, 1.0, -2.0] + noise)
        found.append((first, _deviation(terms, terms, residual)))
    assert np.mean([one for one, _ in found]) == pytest.approx(0.3, abs=0.03)
    assert np.mean([sigma for _, sigma in found]) == pytest.approx(np.std([one for one, _ in found]), rel=0.15)


def test_terms_that_mean_nothing_are_zero() -> None:
    """A lag below half a period or within 1.96 sigma of zero; a sag below 3 mrad, or that rises under a load."""
    lag, sigma = np.array([0.0019, 0.0021, 0.0038, 0.0041]), np.array([0.0, 0.0, 0.002, 0.002])
    sag, offset, largest = np.array([1e-4, 1e-4, -1e-4, 1e-4]), np.full(4, 0.01), np.array([0.0029, 0.0031, 0.1, 0.1])
    servo = _Fit(0.0, lag, sigma, sag, offset, largest).servo(("a", "b", "c", "d"), 0.008, PERIOD_S)
    assert servo.lag_s == pytest.approx([0.0, 0.0021, 0.0, 0.0041])
    assert servo.sag_rad_nm == pytest.approx([0.0, 1e-4, 0.0, 1e-4])
    assert servo.offset_rad == pytest.approx([0.0, 0.01, 0.0, 0.01])
    assert servo.dead_time_s == 0.008


@pytest.mark.parametrize("times", [1.0, -1.0])
def test_a_servo_has_changed_where_its_delay_has_by_more_than_is_uncertain(times: float) -> None:
    """1.96 hypot(3, 4 ms) = 9.8 ms is uncertain of two delays of 3 and 4 ms."""
    none = np.zeros(3)

    def servo(lag_s: float, sigma_s: float) -> ServoModel:
        return ServoModel(("a", "b", "c"), 0.01, none + lag_s, none + sigma_s, none, none)

    for sigmas, more_s, changed in (
        ((0.0, 0.0), 0.0039, False),
        ((0.0, 0.0), 0.0041, True),
        ((0.003, 0.004), 0.0097, False),
        ((0.003, 0.004), 0.0099, True),
    ):
        assert servo_changed(servo(0.05, sigmas[0]), servo(0.05 + times * more_s, sigmas[1])) == changed


def test_the_cup_sags_by_what_the_joints_give_under_the_arms_weight() -> None:
    """First order by the cup's Jacobian, here by differences of its position."""
    none, q = np.zeros(7), ARM.home_rad
    servo = ServoModel(ARM.joint_names, 0.0, none, none, none + 1e-6, none + 1e-5)
    give = 1e-6 * ARM.rigid_effort_nm(q, none, none) + 1e-5
    slope = np.array([(ARM.tool_position_m(q + h) - ARM.tool_position_m(q - h)) / 2e-6 for h in 1e-6 * np.eye(7)])
    assert cup_sag_m(ARM, servo, q) == pytest.approx(np.linalg.norm(give @ slope), rel=1e-3)


def played(robot: LeadingRobot) -> Played:
    return play_motion(robot, swing(0.3).joints, tau_scale=0.7, seed=1)


def path_error_m(one: Played) -> float:
    """Largest distance of the cup from the planned one, by the encoders."""
    planned = np.array([ARM.tool_position_m(row) for row in one.joints.position_rad])
    measured = np.array([ARM.tool_position_m(each.state.position_rad) for each in one.exchanges[1:]])
    return float(np.linalg.norm(measured - planned, axis=1).max())


def leading(lag_s: float, latency_s: float) -> LeadingRobot:
    body = dataclasses.replace(TWIN.imperfection, lag_s=lag_s, latency_s=latency_s)
    return LeadingRobot(SimulatedRobot(ROBOT, GAME, imperfection=body, control_period_s=PERIOD_S), ARM)


def fitted(robot: LeadingRobot, one: Played) -> None:
    robot.lead(servo_of(ARM, one.exchanges, robot.period_s))


def test_the_twins_lag_is_found_and_its_cup_then_follows_the_plan() -> None:
    robot = leading(0.12, 0.010)
    first = played(robot)
    fitted(robot, first)
    assert robot.servo is not None
    assert float(np.median(robot.servo.lag_s)) == pytest.approx(0.12, rel=0.04)
    assert (robot.servo.sag_rad_nm >= 0.0).all(), "friction in the wrist is no sag"
    assert path_error_m(first) > 0.07
    assert path_error_m(played(robot)) < 0.004  # 1.8 mm measured: a dead time counts in whole periods of 4 ms


def test_the_command_of_an_arm_that_follows_passes_unchanged() -> None:
    robot = LeadingRobot(SimulatedRobot(ROBOT, GAME, imperfection=None, control_period_s=PERIOD_S), ARM)
    first = played(robot)
    fitted(robot, first)
    assert robot.servo is None
    again = played(robot)
    assert all(
        np.array_equal(one.state.position_rad, other.state.position_rad)
        for one, other in zip(first.exchanges, again.exchanges, strict=True)
    )


def test_a_servo_of_other_joints_is_refused_before_anything_moves() -> None:
    robot = leading(0.0, 0.0)
    one = played(robot)
    fitted(robot, one)
    servo = found(ARM, motion(), lagging(motion(), 0.1), PERIOD_S)
    with pytest.raises(StageError, match="identify it again; nothing was moved"):
        robot.lead(dataclasses.replace(servo, joint_names=tuple(f"other{j}" for j in range(7))))


def stepped(seconds: float = 2.4, push_rad_s2: float = 1.5) -> JointTrajectory:
    """Motion of the first joint whose acceleration turns about every 0.4 s, as a swing-up's does."""
    t_s = np.arange(round(seconds / PERIOD_S)) * PERIOD_S
    rows = np.zeros((3, len(t_s), 7))
    rows[2, :, 0] = push_rad_s2 * np.where(t_s % 0.8 < 0.4, 1.0, -1.0)
    rows[1] = PERIOD_S * np.cumsum(rows[2], axis=0)
    rows[0] = ARM.home_rad + PERIOD_S * np.cumsum(rows[1] - 0.5 * PERIOD_S * rows[2], axis=0)
    return JointTrajectory(ARM.joint_names, t_s, *rows)


def test_what_a_limit_cuts_of_a_step_of_the_acceleration_is_caught_up_with() -> None:
    robot = leading(0.12, 0.010)
    fitted(robot, played(robot))
    one = play_motion(robot, stepped(), tau_scale=1.0, seed=1)
    measured = np.array([each.state.position_rad[0] for each in one.exchanges[1:]])
    error = np.abs(measured - one.joints.position_rad[:, 0])
    settled = (one.joints.t_s % 0.4 > 0.3) & (one.joints.t_s < 2.4)
    assert error[settled].max() < 0.002  # 0.7 mrad measured; 6.5 where the position cut at the step stays missing
