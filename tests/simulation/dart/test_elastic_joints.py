"""Links on elastic joints, against scipy's integrator and in the trace of a rollout."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.arm_errors import ArmErrors, ElasticJoints
from kendama_cli.simulation.dart.rollout import play_rollout
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld
from tests.simulation.dart.bench_robot import bench_arm, kendama_game, modelled

DAMPING = 0.05


def test_the_deflections_are_those_of_a_damped_spring() -> None:
    links, w = ElasticJoints(1, 8.0, DAMPING, STEP_S), 2 * np.pi * 8.0
    excited = [3.0 if k < 50 else -1.0 for k in range(200)]
    swung = [links.swung(np.array([one])) for one in excited]

    def spring(t_s: float, state: Array) -> list[float]:
        return [state[1], -2 * DAMPING * w * state[1] - w * w * state[0] - excited[min(int(t_s / STEP_S), 199)]]

    solved = solve_ivp(spring, (0, 0.199), [0.0, 0.0], max_step=STEP_S / 4, t_eval=STEP_S * np.arange(200), rtol=1e-8)
    assert [float(one[0][0]) for one in swung] == pytest.approx(solved.y[0], abs=1e-6)
    assert [float(one[1][0]) for one in swung] == pytest.approx(solved.y[1], abs=1e-4)
    assert float(swung[60][2][0]) == pytest.approx(spring(0.0605, solved.y[:, 60])[1], abs=1e-3)


class _Encoders:
    """Corrects nothing, and keeps what it is given to read."""

    steps = 1

    def __init__(self) -> None:
        self.read_rad: list[Array] = []

    def coming(self, t_s: float, position_rad: Array, ball_m: Array) -> None:
        self.read_rad.append(position_rad)


@pytest.mark.parametrize("resonance_hz", [6.0, 12.0])
def test_the_cup_swings_at_the_resonance_after_the_motors_have_stopped_and_no_encoder_sees_it(
    resonance_hz: float,
) -> None:
    """In 0.1 s a joint goes 0.01 rad with one sine of acceleration; the trace is of the rest that follows."""
    arm = modelled(bench_arm())
    t_s = STEP_S * np.arange(2001)
    u, n = np.clip(t_s / 0.1, 0.0, 1.0), len(arm.joint_names)
    turn, joint = 2 * np.pi, np.eye(n)[3]
    moves = t_s < 0.1
    position = arm.home_rad + np.outer(0.01 * (u - np.sin(turn * u) / turn), joint)
    velocity = np.outer(np.where(moves, 0.01 / 0.1 * (1 - np.cos(turn * u)), 0.0), joint)
    acceleration = np.outer(np.where(moves, 0.01 / 0.01 * turn * np.sin(turn * u), 0.0), joint)
    joints = JointTrajectory(arm.joint_names, t_s, position, velocity, acceleration)
    none, encoders = (0.0,) * n, _Encoders()
    world = ArmWorld(dataclasses.replace(bench_arm(), coulomb_nm=none, stribeck_nm=none), kendama_game())
    errors = ArmErrors(resonance_hz=resonance_hz, resonance_damping=DAMPING)
    made = play_rollout(world, joints, errors=errors, correction=encoders, record=True)
    assert made.trace is not None
    rest = made.trace.position_rad[made.trace.t_s >= 0.15][:, 3] - position[-1, 3]
    spectrum = np.abs(np.fft.rfft((rest - rest.mean()) * np.hanning(len(rest)), 16 * len(rest)))
    spacing_s = float(made.trace.t_s[-1] - made.trace.t_s[-2])
    found_hz = np.fft.rfftfreq(16 * len(rest), spacing_s)[spectrum.argmax()]
    assert found_hz == pytest.approx(resonance_hz * np.sqrt(1 - DAMPING**2), rel=0.02)
    assert np.abs(rest).max() > 5e-4
    read = np.array(encoders.read_rad)[round(0.15 / STEP_S) :, 3] - position[-1, 3]
    assert np.abs(read).max() < 0.2 * np.abs(rest).max()
