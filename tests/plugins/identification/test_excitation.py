"""Exciting motions keep to every limit, and show each joint at all speeds in both directions."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import yaml

from kendama_cli.errors import StageError
from kendama_cli.plugins.identification import excitation as exciting
from kendama_cli.plugins.identification.excitation import excitation
from kendama_cli.plugins.identification.recording import RAMP_S, JointRecording, TrackedPath, circle
from kendama_cli.plugins.identification.settings import IdentifySettings
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.settings import build
from tests.simulation.dart.bench_robot import bench_arm, kendama_game, modelled

SHIPPED = build(
    IdentifySettings,
    yaml.safe_load((Path(__file__).parents[3] / "conf/identify/sweep.yaml").read_text()),
    "identify",
)
GAME = kendama_game()
PERIOD_S = 0.004


@pytest.fixture(scope="module")
def arm() -> RobotModel:
    return modelled(bench_arm())


@pytest.mark.parametrize("seed", range(3))
def test_the_motion_begins_and_ends_at_rest_at_home_and_keeps_to_its_share_of_the_limits(
    arm: RobotModel, seed: int
) -> None:
    motion = excitation(arm, GAME, SHIPPED, duration_s=24.0, period_s=PERIOD_S, rng=np.random.default_rng(seed))
    # home itself, but for joints that stand nearer to a stop than they are to move
    center = np.clip(arm.home_rad, arm.limits.lower_rad + 0.255, arm.limits.upper_rad - 0.255)
    for end in (0, -1):
        assert motion.position_rad[end] == pytest.approx(center, abs=1e-9)
        assert motion.velocity_rad_s[end] == pytest.approx(np.zeros(7), abs=1e-5)
    assert np.abs(motion.position_rad - center).max() <= 1.0001 * SHIPPED.amplitude_rad
    # the window and the sweeping tempo add a little to the sines' own slopes
    assert (np.abs(motion.velocity_rad_s) <= 1.1 * SHIPPED.limit_ratio * arm.limits.velocity_rad_s).all()
    assert (np.abs(motion.acceleration_rad_s2) <= 1.2 * SHIPPED.limit_ratio * arm.limits.acceleration_rad_s2).all()


def test_every_joint_is_seen_slow_and_fast_in_both_directions(arm: RobotModel) -> None:
    speed = excitation(
        arm, GAME, SHIPPED, duration_s=24.0, period_s=PERIOD_S, rng=np.random.default_rng(0)
    ).velocity_rad_s
    fastest = np.abs(speed).max(axis=0)
    for low, high in ((0.02, 0.1), (0.1, 0.3), (0.3, 1.0)):
        for sign in (-1, 1):
            seen = ((sign * speed > low * fastest) & (sign * speed < high * fastest)).sum(axis=0)
            assert seen.min() > 25  # a tenth of a second


def test_the_same_stream_gives_the_same_motion(arm: RobotModel) -> None:
    one, other = (
        excitation(arm, GAME, SHIPPED, duration_s=5.0, period_s=PERIOD_S, rng=np.random.default_rng(4))
        for _ in range(2)
    )
    assert np.array_equal(one.position_rad, other.position_rad)


def test_an_amplitude_beyond_a_joints_range_names_the_joint_and_the_range(arm: RobotModel) -> None:
    settings = dataclasses.replace(SHIPPED, amplitude_rad=2.0)
    with pytest.raises(StageError, match=r"joint 's2' of pa10 cannot be excited by 2.0 rad both ways; allowed: 1.55"):
        excitation(arm, GAME, settings, duration_s=5.0, period_s=PERIOD_S, rng=np.random.default_rng(0))


def test_an_arm_too_weak_for_the_motion_names_the_joint() -> None:
    weak = modelled(bench_arm())
    weak.limits = dataclasses.replace(weak.limits, effort_nm=np.ones(7))
    with pytest.raises(StageError, match=r"joint '..' of pa10 would need .* of its effort limit even for slow motions"):
        excitation(weak, GAME, SHIPPED, duration_s=5.0, period_s=PERIOD_S, rng=np.random.default_rng(0))


def test_links_that_would_touch_are_named(arm: RobotModel, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exciting, "CAPSULE_SLACK_M", -1.0)  # then everything is too near
    with pytest.raises(
        StageError, match=r" and .* of pa10 would overlap by .* mm in the exciting motion; allowed: .* mm"
    ):
        excitation(arm, GAME, SHIPPED, duration_s=8.0, period_s=PERIOD_S, rng=np.random.default_rng(0))


def test_on_the_circle_the_cup_has_the_wanted_speed(arm: RobotModel) -> None:
    made = circle(arm, SHIPPED, PERIOD_S)
    cup = np.array([arm.tool_position_m(row) for row in made.joints.position_rad])
    speed = np.linalg.norm(np.diff(cup, axis=0), axis=1) / PERIOD_S
    t_s = made.joints.t_s[:-1]
    steady = (t_s > RAMP_S) & (t_s < t_s[-1] - RAMP_S)
    assert made.speed_m_s == 1.0
    assert speed[steady] == pytest.approx(np.ones(steady.sum()), rel=1e-3)  # a chord is shorter than its arc
    assert speed[[0, -1]] == pytest.approx(np.zeros(2), abs=1e-3)


def test_a_speed_beyond_the_limits_is_lowered_to_one_within(arm: RobotModel) -> None:
    made = circle(arm, dataclasses.replace(SHIPPED, tracking_speed_m_s=6.0), PERIOD_S)
    assert 1.0 < made.speed_m_s < 6.0
    assert (np.abs(made.joints.velocity_rad_s) <= arm.limits.velocity_rad_s).all()


def test_a_delay_is_told_apart_from_a_miss(arm: RobotModel) -> None:
    joints = circle(arm, SHIPPED, PERIOD_S).joints
    late = np.vstack([np.tile(joints.position_rad[0], (5, 1)), joints.position_rad[:-5]])
    rest = np.zeros_like(late)
    path = TrackedPath(
        arm, joints, JointRecording(joints.t_s, joints.position_rad, late, rest, rest, np.zeros((len(late), 6)))
    )
    assert path.delay_s() == pytest.approx(5 * PERIOD_S, abs=1e-5)
    assert path.rms_m(path.delay_s()) < 1e-5
    assert path.rms_m(0.0) == pytest.approx(0.02, rel=0.02)  # 20 ms at 1 m/s
