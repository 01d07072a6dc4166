"""The laws of a task-space controller, for every variant or a project's own (run: see kendama_cli/conformance.py).

Each check takes a function that makes a fresh controller and raises AssertionError, with the law in words, where the
controller breaks it. ``CHECKS`` lists them all. The arm is a random one: no law depends on which it is.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from kendama_cli.motion.rotation import exp_of
from kendama_cli.plugins.interact.interface import TaskController, TaskReference, TaskState
from kendama_cli.plugins.interact.settings import make_controller

MakeController = Callable[[], TaskController]

PERIOD_S = 0.001
DOWN = np.array([0.0, 0.0, -1.0])


def check_rest(make: MakeController) -> None:
    """Check that at its reference, with no force desired, the tool is left alone: the robot carries its own weight."""
    state = bench_state()
    command = _reset(make, state).command(state, resting_at(state), PERIOD_S)
    _law(command.torque_nm.shape == state.position_rad.shape, "there is one torque per joint")
    _law(command.velocity_rad_s.shape == state.position_rad.shape, "there is one speed per joint")
    _law(bool(np.abs(command.torque_nm).max() < 1e-9), "at rest in place nothing is asked of the joints")


def check_pull(make: MakeController) -> None:
    """Check that the tool is pulled toward its reference in every direction, and its axis is turned toward it."""
    state = bench_state()
    here = resting_at(state)
    for axis in np.vstack([np.eye(3), -np.eye(3)]):
        aside = dataclasses.replace(here, position_m=here.position_m + 0.01 * axis)
        _law(float(_tool_force(make, state, aside)[:3] @ axis) > 0, "a tool aside is pulled to its reference")
    for axis in np.vstack([state.tool_rotation.T[:2], -state.tool_rotation.T[:2]]):
        turned = dataclasses.replace(here, rotation=exp_of(0.1 * axis) @ here.rotation)
        _law(float(_tool_force(make, state, turned)[3:] @ axis) > 0, "a turned tool is turned back")


def check_damping(make: MakeController) -> None:
    """Check that motion of the tool only loses energy where the reference rests."""
    state = bench_state()
    rng = np.random.default_rng(4)
    for _ in range(50):
        moving = dataclasses.replace(state, velocity_rad_s=rng.normal(0.0, 1.0, len(state.position_rad)))
        command = _reset(make, moving).command(moving, resting_at(moving), PERIOD_S)
        power_w = float(command.torque_nm @ moving.velocity_rad_s)
        _law(power_w < 0, f"a moving tool that shall rest is braked (power {power_w:.3g} W)")


def check_force(make: MakeController) -> None:
    """Check that the tool exerts a desired force, where that force is measured."""
    state = bench_state()
    pressing = dataclasses.replace(resting_at(state), force_n=10.0 * DOWN, force_axis=DOWN, force_share=1.0)
    felt = dataclasses.replace(state, contact_n=10.0 * DOWN)
    force = _tool_force(make, felt, pressing)
    _law(bool(np.allclose(force, [0, 0, -10, 0, 0, 0], atol=1e-3)), f"the tool exerts the wanted force (is {force})")


def check_reset(make: MakeController) -> None:
    """Check that a reset leaves nothing of before: the same states give the same torques, bit for bit."""
    state = bench_state()
    pressing = dataclasses.replace(resting_at(state), force_n=10.0 * DOWN, force_axis=DOWN, force_share=1.0)
    felt = dataclasses.replace(state, contact_n=4.0 * DOWN)
    controller = make()
    runs = []
    for _ in range(2):
        controller.reset(state.position_rad)
        runs.append([controller.command(felt, pressing, PERIOD_S).torque_nm for _ in range(20)])
    _law(bool(np.array_equal(runs[0], runs[1])), "a reset makes the controller forget")


CHECKS = (check_rest, check_pull, check_damping, check_force, check_reset)


def subject(configuration: Mapping[str, Any]) -> MakeController:
    """Make the controller of ``interact.controller``."""
    return lambda: make_controller(configuration["interact"].controller)


def test_the_controller_keeps_the_law(law: Callable[[MakeController], None], configuration: Mapping[str, Any]) -> None:
    """Run by kendama_cli/conformance.py for every law."""
    law(subject(configuration))


def bench_state() -> TaskState:
    """Return a seven-jointed arm at rest, made up: any full Jacobian and any positive inertia will do."""
    rng = np.random.default_rng(3)
    n = 7
    root = rng.normal(0.0, 0.3, (n, n))
    return TaskState(
        position_rad=rng.uniform(-1.0, 1.0, n),
        velocity_rad_s=np.zeros(n),
        tool_m=rng.uniform(-1.0, 1.0, 3),
        tool_rotation=exp_of(rng.normal(0.0, 1.0, 3)),
        jacobian=rng.normal(0.0, 1.0, (6, n)),
        jacobian_rate=rng.normal(0.0, 1.0, (6, n)),
        inertia=root @ root.T + np.eye(n),
        contact_n=np.zeros(3),
    )


def resting_at(state: TaskState) -> TaskReference:
    """Return a reference at the tool's pose, at rest, with no force desired."""
    none = np.zeros(3)
    return TaskReference(state.tool_m, state.tool_rotation, np.zeros(6), np.zeros(6), none, none, 0.0)


def _reset(make: MakeController, state: TaskState) -> TaskController:
    controller = make()
    controller.reset(state.position_rad)
    return controller


def _tool_force(make: MakeController, state: TaskState, reference: TaskReference) -> np.ndarray:
    """Return the force and torque on the tool (6,) that the torques stand for: the F of J^T F nearest to them."""
    command = _reset(make, state).command(state, reference, PERIOD_S)
    found: np.ndarray = np.linalg.lstsq(state.jacobian.T, command.torque_nm, rcond=None)[0]
    return found


def _law(holds: bool, words: str) -> None:
    if not holds:
        raise AssertionError(f"broken law: {words}")
