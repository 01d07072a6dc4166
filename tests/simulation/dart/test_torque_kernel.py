"""The commanded torque beside the equation of computed torque, for references that the drive passes or holds back."""

import numpy as np
import pytest

from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.simulation.dart import torque_kernel
from kendama_cli.simulation.dart.drive_kernel import MEAN, POSITION, VELOCITY, Drive
from kendama_cli.simulation.dart.torque_kernel import FINE, LIMITED, NOT_FINITE

N, PERIOD = 4, 0.01
GAINS = np.array([40.0, 12.0, PERIOD])


@pytest.mark.parametrize("reach", [0.1, 30.0])
def test_the_torque_is_inertia_times_what_is_desired_and_errors_ask_for_beside_the_bias(reach):
    """tau = H (q_r'' + Kd (q_r' - q') + Kp (q_r - q - noise)) + bias, q_r of before the drive moves on."""
    rng, answers = np.random.default_rng(1), set()
    limits = JointLimits(-2 * np.ones(N), 2 * np.ones(N), 3 * np.ones(N), 50 * np.ones(N), 20 * np.ones(N))
    for _ in range(60):
        drive, (q, v, noise, bias) = Drive(limits, PERIOD), rng.normal(0, [[0.3], [0.5], [0.01], [5.0]], (4, N))
        drive.reset(q + 0.01 * rng.normal(size=N), 0.5 * rng.normal(size=N))
        before = drive.state.copy()
        wish = before[VELOCITY] + reach * rng.normal(size=N)
        reference = before[POSITION] + PERIOD * (before[VELOCITY] + wish) / 2, wish, np.zeros(N)
        square, torque = rng.normal(size=(N, N)), np.empty(N)
        answer = torque_kernel.computed_torque(
            *reference, noise, q, v, drive.state, drive.limits, GAINS, square, bias, torque
        )
        answers.add(answer)
        change = ((drive.state[POSITION] - before[POSITION]) / PERIOD - before[MEAN]) / PERIOD
        desired = change + 12.0 * (before[MEAN] - v) + 40.0 * (before[POSITION] - q - noise)
        assert torque == pytest.approx(square @ desired + bias, rel=1e-9, abs=1e-9)
        if answer == FINE:
            assert drive.position_rad == pytest.approx(reference[0], abs=0)
        joints, unknown = np.abs(rng.normal(size=(5, N))), np.array([1.2, 0.3])
        drive.state[:] = before
        effort, level, again = np.empty(N), np.empty(N), np.empty(N)
        added = rng.normal(size=N)
        assert answer == torque_kernel.command(
            *reference,
            noise,
            added,
            q,
            v,
            drive.state,
            drive.limits,
            GAINS,
            joints,
            unknown,
            square,
            bias,
            effort,
            level,
        )
        assert torque_kernel.efforts(torque, added, v, drive.state[MEAN], joints, unknown, again, np.empty(N))
        assert effort == pytest.approx(again, abs=0)
        dry = joints[0] + joints[1] * np.exp(-((v * joints[2]) ** 2))
        assert level == pytest.approx(1.2 * dry + 0.3)
    assert answers == ({FINE} if reach < 1 else {LIMITED})


def test_a_reference_or_a_torque_that_is_no_number_is_told_and_only_its_joint_s_torque_is_none():
    limits = JointLimits(-2 * np.ones(N), 2 * np.ones(N), 3 * np.ones(N), 50 * np.ones(N), 20 * np.ones(N))
    none = np.zeros(N)
    for row in range(3):
        drive, torque, reference = Drive(limits, PERIOD), np.empty(N), np.zeros((3, N))
        reference[row, 2] = np.nan
        answer = torque_kernel.computed_torque(
            *reference, none, none, none, drive.state, drive.limits, GAINS, np.eye(N), none, torque
        )
        assert answer & NOT_FINITE
        assert (np.isfinite(torque) == [True, True, False, True]).all()
        effort, level = np.empty(N), np.empty(N)
        assert not torque_kernel.efforts(torque, none, none, none, np.ones((5, N)), np.ones(2), effort, level)
        assert (np.isfinite(effort) == [True, True, False, True]).all()
