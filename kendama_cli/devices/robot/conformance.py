"""The laws of the robot's interface, for every variant or a project's own (run: see kendama_cli/conformance.py).

Each check takes a function that opens a fresh robot in a context, and raises AssertionError, with the law in
words, where the robot breaks it. ``CHECKS`` lists them all.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any

import numpy as np

from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot, torque_interface
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.errors import HardwareError, UsageError
from kendama_cli.robot_model.joint_torque import JointTorque
from kendama_cli.schema.arrays import Array

OpenRobot = Callable[[], AbstractContextManager[Robot]]

ROUNDING = 1e-9
"""Relative slack for limits that are reached exactly."""


def check_description(opened: OpenRobot) -> None:
    """Check that names, limits and period fit together."""
    with opened() as robot:
        limits, n = robot.limits, len(robot.joint_names)
        _law(n > 0 and len(set(robot.joint_names)) == n, "joint names are there and differ")
        _law(len(limits.lower_rad) == n, "there is one limit of each kind per joint")
        _law(bool((limits.lower_rad < limits.upper_rad).all()), "lower position limits are below the upper ones")
        for name in ("velocity_rad_s", "acceleration_rad_s2", "effort_nm"):
            _law(bool((getattr(limits, name) > 0).all()), f"{name} limits are positive")
        _law(robot.period_s > 0, "the control period is positive")


def check_time(opened: OpenRobot) -> None:
    """Time starts at 0 with a reset and advances by one period per exchange, and by one for each that was missed."""
    with opened() as robot:
        rest = _rest(robot)
        _law(robot.reset(rest.position_rad, 1).t_s == 0.0, "time is 0 after a reset")
        before = robot.missed
        for k in range(1, 6):
            t_s = robot.exchange(rest).t_s
            periods = k + robot.missed - before
            words = f"time advances by one period per exchange (is {t_s}, {periods} in)"
            _law(abs(t_s - periods * robot.period_s) < 1e-9, words)


def check_rest(opened: OpenRobot) -> None:
    """Check that a robot that is commanded to stay stays, and reports its state in the right shapes."""
    with opened() as robot:
        rest = _rest(robot)
        last = robot.reset(rest.position_rad, 1)
        for _ in range(20):
            last = robot.exchange(rest)
            _law(bool(np.array_equal(last.sent.position_rad, rest.position_rad)), "a feasible command is sent as it is")
        _law(bool(np.abs(last.state.position_rad - rest.position_rad).max() < 0.02), "commanded to stay, the arm stays")
        _law(len(last.state.effort_nm) == len(robot.joint_names), "there is one effort per joint")
        _law(last.state.wrist_wrench.shape == (6,), "the wrist's sensor reads three forces and three torques")
        _law(bool(np.isfinite(last.state.wrist_wrench).all()), "the wrist's sensor reads finite values")
        _law(last.state.cup_in_world_m.shape == (3,) == last.state.ball_in_world_m.shape, "cup and ball are positions")
        _law(not last.state.caught, "a ball that hangs is not caught")


def check_limits(opened: OpenRobot) -> None:
    """Check that commands as sent keep to the position, velocity and acceleration limits, whatever was commanded."""
    with opened() as robot:
        limits, n = robot.limits, len(robot.joint_names)
        rng = np.random.default_rng(5)
        last, before = robot.reset(_rest(robot).position_rad, 1).sent, robot.missed
        for k in range(120):
            wild = rng.normal(0.0, 30.0, (4, n)) if k < 60 else np.full((4, n), 50.0)
            try:
                sent = robot.exchange(JointCommand(*wild)).sent
            except HardwareError:
                _law(robot.realtime, "a simulated robot limits what is commanded, and does not stop for it")
                return  # it halts for a command so far from what it can do
            elapsed_s, before = (1 + robot.missed - before) * robot.period_s, robot.missed
            inside = limits.to_stop_rad(sent.position_rad) >= -ROUNDING
            _law(bool(inside.all()), "what is sent keeps to the position limits")
            _within(sent.velocity_rad_s, limits.velocity_rad_s, "speed")
            change = (sent.velocity_rad_s - last.velocity_rad_s) / elapsed_s
            _within(change, limits.acceleration_rad_s2, "acceleration")
            _within(sent.acceleration_rad_s2, limits.acceleration_rad_s2, "acceleration")
            mean = (sent.position_rad - last.position_rad) / elapsed_s
            _within(mean, limits.velocity_rad_s, "speed")
            _within(sent.effort_nm, limits.effort_nm, "effort")
            last = sent


def check_absurd(opened: OpenRobot) -> None:
    """Check that an absurd command is refused, not clipped, and the robot has halted for good."""
    for absurd in (np.nan, np.inf, -1e300):
        for field in ("position_rad", "velocity_rad_s", "acceleration_rad_s2", "effort_nm"):
            with opened() as robot:
                rest = _rest(robot)
                robot.reset(rest.position_rad, 0)
                values = np.array(getattr(rest, field))
                values[-1] = absurd
                command = dataclasses.replace(rest, **{field: values})
                _law(_refuses(robot.exchange, command), f"a {field} of {absurd} is refused with HardwareError")
                _law(_refuses(robot.exchange, rest), f"after a {field} of {absurd} the robot stays halted")


def check_feedforward(opened: OpenRobot) -> None:
    """Check that an added torque reaches the motors: at rest the arm yields to it."""
    with opened() as robot:
        rest = _rest(robot)
        pushed = dataclasses.replace(rest, effort_nm=0.02 * robot.limits.effort_nm)
        plain, added = (_settled(robot, rest, command) for command in (rest, pushed))
        _law(bool(np.array_equal(plain.sent.effort_nm, rest.effort_nm)), "no effort is added unasked")
        if not added.sent.effort_nm.any():
            return  # it says that it adds none
        _law(bool(np.array_equal(added.sent.effort_nm, pushed.effort_nm)), "a feasible effort is sent as it is")
        moved = np.abs(added.state.position_rad - plain.state.position_rad).max()
        _law(bool(moved > 1e-6), "an added effort moves the arm out of its rest")


def check_reset(opened: OpenRobot) -> None:
    """Check that the same seed and commands give the same rollout, bit for bit in lockstep, whatever came before."""
    with opened() as robot:
        first = _short_rollout(robot, seed=3)
        _short_rollout(robot, seed=4)
        again = _short_rollout(robot, seed=3)
        if robot.realtime:
            off = np.abs(first[0].state.position_rad - again[0].state.position_rad).max()
            _law(bool(off < 0.02), "a reset brings the arm to the same position")
            return
        for a, b in zip(first, again, strict=True):
            for name in ("position_rad", "velocity_rad_s", "wrist_wrench", "ball_in_world_m", "cup_in_world_m"):
                same = np.array_equal(getattr(a.state, name), getattr(b.state, name))
                _law(same, f"a reset with the same seed repeats {name} exactly")


def check_halt(opened: OpenRobot) -> None:
    """Check that halting may be done twice, at any time; after it nothing is carried out."""
    with opened() as robot:
        rest = _rest(robot)
        robot.reset(rest.position_rad, 0)
        robot.exchange(rest)
        robot.halt()
        robot.halt()
        _law(_refuses(robot.exchange, rest), "a halted robot refuses to exchange, with HardwareError")
        _law(_refuses(robot.reset, rest.position_rad, 0), "a halted robot refuses to reset, with HardwareError")
        robot.close()


def check_torque(opened: OpenRobot) -> None:
    """Check torque commands, if offered: none keeps the arm at rest, one moves its joint, and limits are kept."""
    with opened() as robot:
        rest = _rest(robot)
        robot.reset(rest.position_rad, 1)
        torque = robot.torque
        if torque is None:
            return
        n = len(robot.joint_names)
        _law(torque.period_s > 0, "the period of torque control is positive")
        _law(
            torque.effort_nm.shape == (n,) and bool((torque.effort_nm > 0).all()),
            "there is one largest torque per joint",
        )
        none = np.zeros(n)
        for _ in range(50):
            still = torque.exchange(JointTorque(none, none))
        moved = np.abs(still.state.position_rad - rest.position_rad).max()
        _law(bool(moved < 0.02), "without torque the arm stays: the robot carries its own weight")
        robot.reset(rest.position_rad, 1)
        torque = torque_interface(robot, "conformance")
        push = np.where(np.arange(n) == 0, 0.2 * torque.effort_nm, 0.0)
        for _ in range(50):
            pushed = torque.exchange(JointTorque(push, none))
        _law(bool(np.array_equal(pushed.sent.torque_nm, push)), "a feasible torque is sent as it is")
        _law(
            bool(pushed.state.position_rad[0] > rest.position_rad[0] + 1e-6),
            "a torque moves its joint along",
        )
        robot.reset(rest.position_rad, 1)
        wild = torque_interface(robot, "conformance").exchange(JointTorque(100.0 * torque.effort_nm, none))
        _within(wild.sent.torque_nm, torque.effort_nm, "effort")
        _law(_refuses(robot.exchange, rest), "position commands are refused after torque commands, until a reset")


CHECKS = (
    check_description,
    check_time,
    check_rest,
    check_limits,
    check_absurd,
    check_feedforward,
    check_reset,
    check_torque,
    check_halt,
)


def subject(configuration: Mapping[str, Any]) -> OpenRobot:
    """Open the robot of ``hardware``; raises UsageError if it may be real and is not armed."""
    hardware = configuration["hardware"]
    if hardware.moves and not configuration["armed"]:
        raise UsageError(f"robot '{hardware.kind}' may be real and would move; clear its surroundings and add --arm")
    return lambda: open_robot(hardware, configuration["robot"], configuration["game"])


def test_the_robot_keeps_the_law(law: Callable[[OpenRobot], None], configuration: Mapping[str, Any]) -> None:
    """Run by kendama_cli/conformance.py for every law."""
    law(subject(configuration))


def _rest(robot: Robot) -> JointCommand:
    zeros = np.zeros(len(robot.joint_names))
    center = np.clip(zeros, robot.limits.lower_rad + 0.1, robot.limits.upper_rad - 0.1)
    return JointCommand(center, zeros, zeros)


def _settled(robot: Robot, rest: JointCommand, command: JointCommand) -> Exchange:
    robot.reset(rest.position_rad, 1)
    for _ in range(50):
        last = robot.exchange(command)
    return last


def _refuses(call: Callable[..., Exchange], *arguments: object) -> bool:
    try:
        call(*arguments)
    except HardwareError:
        return True
    return False


def _short_rollout(robot: Robot, seed: int) -> list[Exchange]:
    rest = _rest(robot)
    steps = [robot.reset(rest.position_rad, seed)]
    for k in range(1, 21):
        t_s = k * robot.period_s
        speed: Array = np.minimum(0.2, robot.limits.acceleration_rad_s2 * t_s / 4)
        steps.append(robot.exchange(JointCommand(rest.position_rad + speed * t_s, speed, np.zeros(len(speed)))))
    return steps


def _within(values: Array, limits: Array, what: str) -> None:
    over = float((np.abs(values) / limits).max())
    _law(over <= 1 + ROUNDING, f"what is sent keeps to the {what} limits (reached {over:.4f} of one)")


def _law(holds: bool, words: str) -> None:
    if not holds:
        raise AssertionError(f"broken law: {words}")
