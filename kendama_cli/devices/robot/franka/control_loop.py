"""The loop of one millisecond: every state of the arm is answered, by the newest command or by braking."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from kendama_cli.devices.robot.franka.messages import Done, Wanted
from kendama_cli.devices.robot.franka.rate_limit import RateLimiter, RateLimits
from kendama_cli.schema.arrays import Array

CYCLE_S = 0.001
REST_S = 0.2
"""An arm that stands for so long without a command is no longer controlled; the next command takes it up again."""

BRIDGED_RAD = 1e-6
"""An arm that was sent elsewhere by so much has bridged a gap; its state is told in single precision."""


class ActiveControl(Protocol):
    """What pylibfranka gives for a motion that is controlled from here."""

    def readOnce(self) -> tuple[Any, Any]:  # noqa: N802 (theirs)
        """Wait for the next state."""

    def writeOnce(self, command: Any) -> None:  # noqa: N802 (theirs)
        """Answer it."""


class ControlLoop:
    """Controls the arm for as long as commands come; ``next_command`` waits at most so long, or gives None."""

    def __init__(
        self,
        limits: RateLimits,
        cycles: int,
        next_command: Callable[[float], Wanted | None],
        tell: Callable[[Done], None],
        positions: Callable[[list[float]], Any],
    ) -> None:
        """``cycles`` is the control period in milliseconds; ``positions`` makes the command that the arm takes."""
        self._limits, self._cycles = limits, cycles
        self._next_command, self._tell, self._positions = next_command, tell, positions
        self.periods = self._lost = 0

    def run(self, active: ActiveControl, first: Wanted, reply_s: float) -> None:
        """From the first command until the arm has stood for REST_S without one; raises what ``active`` does."""
        state, _ = active.readOnce()
        limiter = RateLimiter(self._limits, np.array(state.q_d), CYCLE_S)
        at, wanted, still = Wanted(limiter.position_rad, np.zeros_like(limiter.position_rad)), first, 0
        commanded = True
        while True:
            for cycle in range(1, self._cycles + 1):
                reference = between(at, wanted, cycle / self._cycles, self._period_s)
                command = self._positions(limiter.follow(reference).tolist())
                if still * self._period_s > REST_S and cycle == self._cycles:
                    command.motion_finished = True
                active.writeOnce(command)
                if command.motion_finished:
                    return
                state, since = active.readOnce()
                self._bridge(limiter, state, since.to_sec())
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

    def _bridge(self, limiter: RateLimiter, state: Any, since_s: float) -> None:
        """Where an answer came too late the arm went on by itself: count that, and go on from there."""
        self._lost += max(round(since_s / CYCLE_S) - 1, 0)
        if np.abs(np.subtract(state.q_d, limiter.position_rad)).max() > BRIDGED_RAD:
            limiter.begin_at(np.array(state.q_d), np.array(state.dq_d), np.array(state.ddq_d))

    @property
    def _period_s(self) -> float:
        return self._cycles * CYCLE_S

    def _braked(self, at: Wanted) -> Wanted:
        most = 0.5 * self._limits.acceleration_rad_s2 * self._period_s
        speed = at.velocity_rad_s - np.clip(at.velocity_rad_s, -most, most)
        return Wanted(at.position_rad + (at.velocity_rad_s + speed) / 2 * self._period_s, speed)


def between(at: Wanted, wanted: Wanted, share: float, period_s: float) -> Array:
    """The cubic (n,) with position and speed of both ends, ``share`` of the period after its begin."""
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
