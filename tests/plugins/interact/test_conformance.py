"""Both controllers keep the laws of their interface, and the laws notice one that does not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.plugins.interact.conformance import (
    CHECKS,
    DOWN,
    bench_state,
    check_damping,
    check_force,
    check_pull,
    check_reset,
    resting_at,
)
from kendama_cli.plugins.interact.impedance import ForceController, ImpedanceController
from kendama_cli.plugins.interact.impedance_law import TaskReference
from kendama_cli.plugins.interact.interface import JointTorque, TaskController, TaskState
from kendama_cli.plugins.interact.settings import make_controller
from kendama_cli.schema.arrays import Array
from tests.plugins.interact.shipped_scene import controller


@pytest.mark.parametrize("kind", ["impedance", "force"])
@pytest.mark.parametrize("check", CHECKS)
def test_every_controller_keeps_every_law(kind, check):
    check(lambda: make_controller(controller(kind)))


def test_the_settings_choose_the_controller():
    assert isinstance(make_controller(controller("force")), ForceController)
    assert isinstance(make_controller(controller("impedance")), ImpedanceController)


class _Wrong:
    """A controller whose torque is changed by ``factor``, and that never forgets."""

    def __init__(self, factor: float) -> None:
        self._right: TaskController = make_controller(controller("impedance"))
        self._factor = factor
        self._calls = 0

    def reset(self, posture_rad: Array) -> None:
        self._right.reset(posture_rad)

    def command(self, state: TaskState, reference: TaskReference, period_s: float) -> JointTorque:
        right = self._right.command(state, reference, period_s)
        self._calls += 1
        torque = (self._factor + 1e-9 * self._calls) * right.torque_nm
        return dataclasses.replace(right, torque_nm=torque)


@pytest.mark.parametrize(
    ("check", "factor", "words"),
    [
        (check_pull, -1.0, "pulled to its reference"),
        (check_damping, -1.0, "is braked"),
        (check_force, 0.9, "exerts the wanted force"),
        (check_reset, 1.0, "makes the controller forget"),
    ],
)
def test_the_laws_notice_a_controller_that_breaks_them(check, factor, words):
    with pytest.raises(AssertionError, match=words):
        check(lambda: _Wrong(factor))


def test_the_force_controller_brings_the_measured_force_to_the_wanted_one_and_no_farther_than_twice():
    """Its push grows while too little is felt, by at most the wanted force; without contact it does not grow."""
    state = bench_state()
    reference = dataclasses.replace(resting_at(state), force_n=10.0 * DOWN, force_axis=DOWN, force_share=1.0)
    pushes = {}
    for felt_n in (0.0, 6.0, 14.0):
        made = make_controller(controller("force"))
        made.reset(state.position_rad)
        felt = dataclasses.replace(state, contact_n=felt_n * DOWN)
        torques = [made.command(felt, reference, 0.001).torque_nm for _ in range(3000)]
        forces = [np.linalg.lstsq(state.jacobian.T, torque, rcond=None)[0][2] for torque in (torques[0], torques[-1])]
        pushes[felt_n] = -forces[0], -forces[1]
    assert pushes[0.0] == pytest.approx((10.0, 10.0), abs=1e-3)
    assert pushes[6.0] == pytest.approx((10.08, 20.0), abs=1e-3)  # 20/s * 4 N * 1 ms in the first period
    assert pushes[14.0] == pytest.approx((9.92, 0.0), abs=1e-3)
