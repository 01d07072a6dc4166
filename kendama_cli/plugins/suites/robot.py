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

from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.errors import HardwareError, UsageError
from kendama_cli.plugins.suites.law import must
from kendama_cli.schema.arrays import Array

OpenRobot = Callable[[], AbstractContextManager[Robot]]

ROUNDING = 1e-9
"""Relative slack for limits that are reached exactly."""


def check_description(opened: OpenRobot) -> None:
    """Check that names, limits and period fit together."""
    with opened() as robot:
        limits, n = robot.limits, len(robot.joint_names)
        must(n > 0 and len(set(robot.joint_names)) == n, "joint names are there and differ")
        must(len(limits.lower_rad) == n, "there is one limit of each kind per joint")
        must(bool((limits.lower_rad < limits.upper_rad).all()), "lower position limits are below the upper ones")
        for name in ("velocity_rad_s", "acceleration_rad_s2", "effort_nm"):
            must(bool((getattr(limits, name) > 0).all()), f"{name} limits are positive")
        must(robot.period_s > 0, "the control period is positive")


def check_time(opened: OpenRobot) -> None:
    """Time starts at 0 with a reset and advances by one period per exchange, and by one for each that was missed."""
    with opened() as robot:
        rest = _rest(robot)
        must(robot.reset(rest.position_rad, 1).t_s == 0.0, "time is 0 after a reset")
        before = robot.missed
        for k in range(1, 6):
            t_s = robot.exchange(rest).t_s
            periods = k + robot.missed - before
            words = f"time advances by one period per exchange (is {t_s}, {periods} in)"
            must(abs(t_s - periods * robot.period_s) < 1e-9, words)


def check_rest(opened: OpenRobot) -> None:
    """Check that a robot that is commanded to stay stays, and reports its state in the right shapes."""
    with opened() as robot:
        rest = _rest(robot)
        last = robot.reset(rest.position_rad, 1)
        for _ in range(20):
            last = robot.exchange(rest)
            must(bool(np.array_equal(last.sent.position_rad, rest.position_rad)), "a feasible command is sent as it is")
        must(bool(np.abs(last.state.position_rad - rest.position_rad).max() < 0.02), "commanded to stay, the arm stays")
        must(len(last.state.effort_nm) == len(robot.joint_names), "there is one effort per joint")
        must(last.state.wrist_wrench.shape == (6,), "the wrist's sensor reads three forces and three torques")
        must(bool(np.isfinite(last.state.wrist_wrench).all()), "the wrist's sensor reads finite values")
        must(last.state.cup_in_world_m.shape == (3,) == last.state.ball_in_world_m.shape, "cup and ball are positions")
        must(not last.state.caught, "a ball that hangs is not caught")


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
                must(robot.realtime, "a simulated robot limits what is commanded, and does not stop for it")
                return  # it halts for a command so far from what it can do
            elapsed_s, before = (1 + robot.missed - before) * robot.period_s, robot.missed
            inside = limits.to_stop_rad(sent.position_rad) >= -ROUNDING
            must(bool(inside.all()), "what is sent keeps to the position limits")
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
                must(_refuses(robot.exchange, command), f"a {field} of {absurd} is refused with HardwareError")
                must(_refuses(robot.exchange, rest), f"after a {field} of {absurd} the robot stays halted")


def check_feedforward(opened: OpenRobot) -> None:
    """Check that an added torque reaches the motors: at rest the arm yields to it."""
    with opened() as robot:
        rest = _rest(robot)
        pushed = dataclasses.replace(rest, effort_nm=0.02 * robot.limits.effort_nm)
        plain, added = (_settled(robot, rest, command) for command in (rest, pushed))
        must(bool(np.array_equal(plain.sent.effort_nm, rest.effort_nm)), "no effort is added unasked")
        if not added.sent.effort_nm.any():
            return  # it says that it adds none
        must(bool(np.array_equal(added.sent.effort_nm, pushed.effort_nm)), "a feasible effort is sent as it is")
        moved = np.abs(added.state.position_rad - plain.state.position_rad).max()
        must(bool(moved > 1e-6), "an added effort moves the arm out of its rest")


def check_reset(opened: OpenRobot) -> None:
    """Check that the same seed and commands give the same rollout, bit for bit in lockstep, whatever came before."""
    with opened() as robot:
        first = _short_rollout(robot, seed=3)
        _short_rollout(robot, seed=4)
        again = _short_rollout(robot, seed=3)
        if robot.realtime:
            off = np.abs(first[0].state.position_rad - again[0].state.position_rad).max()
            must(bool(off < 0.02), "a reset brings the arm to the same position")
            return
        for a, b in zip(first, again, strict=True):
            for name in ("position_rad", "velocity_rad_s", "wrist_wrench", "ball_in_world_m", "cup_in_world_m"):
                same = np.array_equal(getattr(a.state, name), getattr(b.state, name))
                must(same, f"a reset with the same seed repeats {name} exactly")


def check_halt(opened: OpenRobot) -> None:
    """Check that halting may be done twice, at any time; after it nothing is carried out."""
    with opened() as robot:
        rest = _rest(robot)
        robot.reset(rest.position_rad, 0)
        robot.exchange(rest)
        robot.halt()
        robot.halt()
        must(_refuses(robot.exchange, rest), "a halted robot refuses to exchange, with HardwareError")
        must(_refuses(robot.reset, rest.position_rad, 0), "a halted robot refuses to reset, with HardwareError")
        robot.close()


CHECKS = (
    check_description,
    check_time,
    check_rest,
    check_limits,
    check_absurd,
    check_feedforward,
    check_reset,
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
    must(over <= 1 + ROUNDING, f"what is sent keeps to the {what} limits (reached {over:.4f} of one)")
