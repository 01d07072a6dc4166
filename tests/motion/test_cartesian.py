"""Position and orientation in one primitive."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kendama_cli.artifacts.motion_plan import PosePlan
from kendama_cli.motion.cartesian import encode_pose, play_pose
from kendama_cli.motion.rotation import exponential, inverse, logarithm, multiply
from kendama_cli.schema.arrays import Array
from tests.motion.swings import path, settings, smooth_step

T = np.arange(0, 2.001, 0.01)
CHOSEN = settings(trim="none")


def turning(t: Array) -> Array:
    """A tool that tilts by 1.2 rad and comes half back while it yaws, from an orientation of its own; (n, 4)."""
    u = t / 2.0
    tilt = 1.2 * smooth_step((u - 0.15) / 0.4) - 0.6 * smooth_step((u - 0.5) / 0.4)
    yaw = 0.8 * smooth_step((u - 0.2) / 0.6)
    tilted = exponential(tilt[:, None] * np.array([0.0, 1.0, 0.0]))
    return multiply(exponential(yaw[:, None] * np.array([0.0, 0.0, 1.0])), multiply(tilted, START))


START = exponential(np.array([[0.3, -0.2, 2.5]]))[0]


@pytest.fixture(scope="module")
def plan() -> PosePlan:
    return encode_pose(T, path(T), turning(T), CHOSEN)


def angle_between(one: Array, other: Array) -> Array:
    return np.asarray(np.linalg.norm(logarithm(multiply(one, inverse(other))), axis=1))


def test_position_and_orientation_are_reproduced(plan: PosePlan) -> None:
    made = play_pose(plan, T)
    assert np.linalg.norm(made.position_m - (path(T) - path(T)[0]), axis=1).max() < 1e-3
    assert angle_between(made.rotation_wxyz, turning(T)).max() < 2e-3
    assert np.allclose(np.linalg.norm(made.rotation_wxyz, axis=1), 1, atol=1e-12)


def test_the_angular_velocity_is_the_derivative_of_the_orientation(plan: PosePlan) -> None:
    t, h = np.linspace(0.1, 1.9, 50), 1e-5
    before, after = (play_pose(plan, t + shift).rotation_wxyz for shift in (-h, h))
    truth = logarithm(multiply(after, inverse(before))) / (2 * h)
    assert np.abs(play_pose(plan, t).angular_velocity_rad_s - truth).max() < 1e-5


def test_flips_of_the_quaternions_sign_change_nothing(plan: PosePlan) -> None:
    flips = np.random.default_rng(3).choice([-1.0, 1.0], (len(T), 1))
    flipped = encode_pose(T, path(T), flips * turning(T), CHOSEN)
    assert angle_between(play_pose(flipped, T).rotation_wxyz, play_pose(plan, T).rotation_wxyz).max() < 1e-9


def test_turning_the_world_turns_the_motion(plan: PosePlan) -> None:
    world = exponential(np.array([0.4, 1.1, -0.7]))
    turned = encode_pose(T, path(T), multiply(world, turning(T)), CHOSEN)
    expected = multiply(world, play_pose(plan, T).rotation_wxyz)
    assert angle_between(play_pose(turned, T).rotation_wxyz, expected).max() < 1e-6


def test_turning_the_tool_in_the_hand_turns_it_throughout(plan: PosePlan) -> None:
    tool = exponential(np.array([-0.9, 0.2, 0.5]))
    turned = encode_pose(T, path(T), multiply(turning(T), tool), CHOSEN)
    expected = multiply(play_pose(plan, T).rotation_wxyz, tool)
    assert angle_between(play_pose(turned, T).rotation_wxyz, expected).max() < 1e-9


def test_the_orientation_is_held_after_the_end(plan: PosePlan) -> None:
    late = play_pose(plan, np.array([3.0, 300.0]))
    assert angle_between(late.rotation_wxyz, turning(np.array([2.0, 2.0]))).max() < 2e-3
    assert angle_between(late.rotation_wxyz[:1], late.rotation_wxyz[1:]).max() < 1e-9


def test_resting_heads_are_cut_from_the_orientation_too() -> None:
    t = np.arange(0, 4.001, 0.01)
    plan = encode_pose(t, path(t - 1.0), turning(np.clip(t - 1.0, 0, 2)), settings())
    assert plan.motion.duration_s < 2.2
    made = play_pose(plan, np.array([plan.motion.duration_s]))
    assert angle_between(made.rotation_wxyz, turning(np.array([2.0]))).max() < 3e-3


def test_what_is_no_unit_quaternion_is_named_by_its_sample() -> None:
    wrong = turning(T)
    wrong[7] *= 1.3
    with pytest.raises(ValueError, match=r"sample 8: the length of the quaternion is 1\.3; it must be 1"):
        encode_pose(T, path(T), wrong, CHOSEN)


@pytest.mark.recording
def test_a_recorded_arm_turns_its_tool_as_it_was_guided(recordings: Path) -> None:
    """The arm of the recording ramps one of its angles by 50 degrees between sharp corners, which are rounded."""
    rows = np.loadtxt(recordings / "li-kendama" / "kendama1-20.txt")[:350]
    place = np.column_stack((-rows[:, 1], 0 * rows[:, 1], rows[:, 3])) / 1e3
    turned = np.roll(Rotation.from_euler("xyz", rows[:, [6, 5, 4]]).as_quat(), 1, axis=1)
    t = np.arange(350) / 100
    made = play_pose(encode_pose(t, place, turned, settings()), t)
    assert angle_between(made.rotation_wxyz, turned).max() < np.deg2rad(2)
    assert np.linalg.norm(made.position_m - (place - place[0]), axis=1).max() < 1e-3
