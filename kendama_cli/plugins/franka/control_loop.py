"""The loop of one millisecond: every state of the arm is answered, by the newest command or by braking."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.devices.robot.limiter import braked
from kendama_cli.plugins.franka.messages import Done, Wanted
from kendama_cli.plugins.franka.rate_limit import LimiterState, RateLimiter, RateLimits
from kendama_cli.schema.arrays import Array

CYCLE_S = 0.001
REST_S = 0.2
"""An arm that stands for so long without a command is no longer controlled; the next command takes it up again."""

TOLD_RAD = 3e-7
"""States are told in single precision: a joint at 3 rad is rounded to half of this."""


class ActiveControl(Protocol):
    """Handle of pylibfranka for a motion that is controlled from here."""

    def readOnce(self) -> tuple[Any, Any]:  # noqa: N802 (theirs)
        """Wait for the next state."""

    def writeOnce(self, command: Any) -> None:  # noqa: N802 (theirs)
        """Answer it."""


class ControlLoop:
    """Control of the arm as long as commands come; ``next_command`` waits at most so long, or gives None."""

    def __init__(
        self,
        limits: RateLimits,
        cycles: int,
        next_command: Callable[[float], Wanted | None],
        tell: Callable[[Done], None],
        positions: Callable[[list[float]], Any],
    ) -> None:
        """Set the control period, ``cycles`` [ms]; ``positions`` makes the command that the arm takes."""
        self._limits, self._cycles = limits, cycles
        self._next_command, self._tell, self._positions = next_command, tell, positions
        self.periods = self._lost = 0

    def run(self, active: ActiveControl, first: Wanted, reply_s: float) -> None:
        """Run from the first command until the arm has stood for REST_S without one; raises what ``active`` does.

        What answers a state is made before that comes, and all else after it is answered: a state whose answer takes a
        millisecond is lost. So a command acts one cycle after the state that its sender saw last.
        """
        state, _ = active.readOnce()
        limiter = RateLimiter(self._limits, np.array(state.q_d), CYCLE_S)
        at, wanted, still = Wanted(limiter.position_rad, np.zeros_like(limiter.position_rad)), first, 0
        commanded, answered = True, False
        while True:
            for cycle in range(1, self._cycles + 1):
                reference = between(at, wanted, cycle / self._cycles, self._period_s)
                sent = limiter.state
                command = self._positions(limiter.follow(reference).tolist())
                if answered:
                    state, since = active.readOnce()
                    if self._bridged(limiter, sent, state, since.to_sec()):
                        command = self._positions(limiter.follow(reference).tolist())
                if still * self._period_s > REST_S and cycle == self._cycles:
                    command.motion_finished = True
                active.writeOnce(command)
                answered = True
                if command.motion_finished:
                    return
            self.periods += 1 + self._lost // self._cycles
            self._lost %= self._cycles
            if commanded:
                self._tell(_done(limiter, state, self.periods))
            at = wanted
            fresh = self._next_command(reply_s)
            if fresh is not None and not commanded:  # its time stood still while nothing came: go on from its speed
                at = Wanted(fresh.position_rad - self._period_s * fresh.velocity_rad_s, fresh.velocity_rad_s)
                limiter.rebase(at.position_rad)
            commanded, wanted = fresh is not None, fresh or self._braked(at)
            stands = not (limiter.velocity_rad_s.any() or at.velocity_rad_s.any())
            still = still + 1 if fresh is None and stands else 0

    def _bridged(self, limiter: RateLimiter, sent: LimiterState, state: Any, since_s: float) -> bool:
        """Return True if an answer came too late and the arm went on by itself: the limiter then goes on from there.

        An arm goes on with the acceleration it had, so what it tells is known but for the last change of that. One that
        tells something else has only not taken the newest command in yet; to go on from there would be a step back.
        """
        cycles = max(round(since_s / CYCLE_S), 1)
        self._lost += cycles - 1
        told = np.array(state.q_d)
        if cycles == 1 and np.abs(told - sent.position_rad).max() <= TOLD_RAD:
            return False
        limiter.state = sent
        coasted = limiter.coasted(cycles - 1)
        apart = np.abs(told - coasted.position_rad)
        change = self._limits.jerk_rad_s3 * CYCLE_S**3 * cycles * (cycles + 1) / 2
        if apart.max() > TOLD_RAD and (apart <= change + TOLD_RAD).all():
            coasted = dataclasses.replace(
                coasted,
                position_rad=told,
                velocity_rad_s=np.array(state.dq_d),
                acceleration_rad_s2=np.array(state.ddq_d),
            )
        limiter.state = coasted
        return True

    @property
    def _period_s(self) -> float:
        return self._cycles * CYCLE_S

    def _braked(self, at: Wanted) -> Wanted:
        last = JointCommand(at.position_rad, at.velocity_rad_s, np.zeros_like(at.velocity_rad_s))
        sent = braked(last, 0.5 * self._limits.acceleration_rad_s2, self._period_s)
        return Wanted(sent.position_rad, sent.velocity_rad_s)


def between(at: Wanted, wanted: Wanted, share: float, period_s: float) -> Array:
    """Return the cubic (n,) with position and velocity of both ends, at the fraction ``share`` of the period."""
    s, rest = share, 1.0 - share
    begin = rest * rest * ((1 + 2 * s) * at.position_rad + s * period_s * at.velocity_rad_s)
    end = s * s * ((1 + 2 * rest) * wanted.position_rad - rest * period_s * wanted.velocity_rad_s)
    return np.asarray(wanted.position_rad if share == 1.0 else begin + end)


def _done(limiter: RateLimiter, state: Any, periods: int) -> Done:
    return Done(
        limiter.position_rad,
        limiter.velocity_rad_s,
        limiter.acceleration_rad_s2,
        np.array(state.q),
        np.array(state.dq),
        np.array(state.tau_J),
        np.array(state.tau_ext_hat_filtered),
        np.array(state.K_F_ext_hat_K),
        periods,
    )
