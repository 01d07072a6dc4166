"""Commands to an arm from millisecond to millisecond never make it stop."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from kendama_cli.motion import minimum_jerk
from kendama_cli.plugins.franka.control_loop import CYCLE_S, ControlLoop
from kendama_cli.plugins.franka.messages import Done, Wanted
from kendama_cli.plugins.franka.rate_limit import RateLimiter, RateLimits
from kendama_cli.schema.arrays import Array
from tests.plugins.franka.arm import FRANKA
from tests.plugins.franka.pylibfranka import START, Arm, ControlException, JointPositions

LIMITS = RateLimits(
    *(
        np.array(getattr(FRANKA, name))
        for name in (
            *("lower_rad", "upper_rad", "velocity_rad_s", "acceleration_rad_s2", "jerk_rad_s3"),
            *("stop_rad_s2", "stop_rad_s"),
        )
    )
)


def swing(reach_rad: float = 0.3, span_s: float = 0.5, period_s: float = CYCLE_S) -> list[Wanted]:
    """All joints away from START and back by minimum jerk."""
    told = []
    for t_s in np.arange(period_s, 2 * span_s + period_s / 2, period_s):
        share, sign = (t_s / span_s, 1.0) if t_s <= span_s else (2 - t_s / span_s, -1.0)
        share = max(share, 0.0)
        rate = sign * float(minimum_jerk.step_rate(share)) / span_s
        told.append(Wanted(START + reach_rad * float(minimum_jerk.step(share)), np.full(7, reach_rad * rate)))
    return told


def played(
    arm: Arm, commands: list[Wanted], cycles: int = 1, late: Callable[[int], bool] = lambda k: False
) -> list[Done]:
    """Have the loop play the commands; where ``late`` says so, one comes a period later than it is due."""
    coming: Iterator[Wanted] = iter(commands[1:])
    done, asked = list[Done](), [0]

    def next_command(wait_s: float) -> Wanted | None:
        asked[0] += 1
        return None if late(asked[0]) else next(coming, None)

    ControlLoop(LIMITS, cycles, next_command, done.append, JointPositions).run(arm, commands[0], 0.0)
    return done


@pytest.mark.parametrize("cycles", [1, 4])
def test_a_motion_within_the_limits_is_sent_as_it_is(cycles: int) -> None:
    arm, commands = Arm(), swing(period_s=cycles * CYCLE_S)
    done = played(arm, commands, cycles)
    assert len(done) == len(commands)
    assert np.array_equal([one.sent_rad for one in done], [one.position_rad for one in commands])
    assert [one.periods for one in done] == list(range(1, len(commands) + 1))
    assert arm.finished, "an arm that stands and is not commanded is let go"


@pytest.mark.parametrize("seed", range(3))
def test_late_commands_and_lost_answers_are_counted_and_stop_nothing(seed: int) -> None:
    """One of ten commands late, one of a hundred answers lost; the arm refuses 10 rad/s^2 and 5000 rad/s^3."""
    rng = np.random.default_rng(seed)
    late, commands = rng.random(5000) < 0.1, swing()
    lost = frozenset((1 + np.flatnonzero(rng.random(len(commands)) < 0.01)).tolist())
    arm = Arm(lost)
    done = played(arm, commands, late=lambda k: bool(late[k]))
    assert len(done) == len(commands)
    missed = done[-1].periods - len(commands)
    assert missed >= late[1 : len(commands)].sum()
    off = np.abs(np.array([one.sent_rad for one in done]) - [one.position_rad for one in commands])
    assert off.max() < 0.02
    assert off[-1].max() < 0.005


def test_a_state_that_does_not_tell_the_newest_command_yet_changes_nothing() -> None:
    """As franka-sim 1.1.7 where its own threads wait for each other; begun there, a millisecond would be lost."""
    commands = swing()
    arm = Arm(stale=frozenset(range(100, len(commands), 50)))
    done = played(arm, commands)
    assert np.array_equal([one.sent_rad for one in done], [one.position_rad for one in commands])


@pytest.mark.parametrize("jump", [0.05, -0.05, 0.1])
def test_a_jump_is_gone_to_within_the_limits(jump: float) -> None:
    arm = Arm()
    done = played(arm, [Wanted(START + jump, np.zeros(7))] * 1500)
    assert np.allclose(done[-1].sent_rad, START + jump, atol=1e-6)


def test_a_commander_that_falls_silent_in_motion_brakes_the_arm_to_rest() -> None:
    arm = Arm()
    played(arm, swing()[:250])
    assert arm.finished
    assert not np.diff(arm.sent[-2:], axis=0).any()


def test_without_limits_the_same_jump_is_a_reflex() -> None:
    arm = Arm()
    arm.readOnce()
    arm.writeOnce(JointPositions((START + 0.05).tolist()))
    with pytest.raises(ControlException, match="velocity_discontinuity"):
        arm.readOnce()


def test_no_joint_comes_nearer_to_its_stop_than_it_can_brake() -> None:
    limiter = RateLimiter(LIMITS, START, CYCLE_S)
    sent: list[Array] = [limiter.follow(LIMITS.upper_rad + 1.0) for _ in range(4000)]
    speed = np.diff(sent, axis=0) / CYCLE_S
    assert (np.array(sent) <= LIMITS.upper_rad).all()
    assert (np.abs(speed) <= LIMITS.velocity_rad_s * (1 + 1e-9)).all()
    way = LIMITS.upper_rad - np.array(sent[:-1])
    room = np.sqrt(2 * LIMITS.stop_rad_s2 * way) - LIMITS.stop_rad_s
    assert (speed <= np.maximum(room, 0.0) + 0.02).all()  # one step of 9 rad/s^2 and what braking rounds off
