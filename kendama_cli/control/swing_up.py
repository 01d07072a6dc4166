"""Swing-up on the robot: the policy acts on the observed state until the goal is reached or time is up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from kendama_cli.control.cup_cart import CartStep, CupCart
from kendama_cli.learning.reward import Goal, Outcome
from kendama_cli.learning.state import SwingState, count_half_swings
from kendama_cli.motion.braking import BrakingLimiter


class SwingUpActor(Protocol):
    """Learner or frozen policy."""

    def act(self, state: SwingState, t_s: float) -> float:
        """Return the cup's acceleration at ``t_s`` into the rollout [m/s^2]."""


@dataclass(frozen=True)
class SwingUpRollout:
    """Result of a swing-up; ``steps`` holds every control period, the reading at rest first."""

    outcome: Outcome
    steps: tuple[CartStep, ...]

    @property
    def last(self) -> SwingState:
        """State in which it ended."""
        return self.steps[-1].state

    @property
    def duration_s(self) -> float:
        """Duration from rest to the end."""
        return self.steps[-1].t_s

    @property
    def peak_displacement_m(self) -> float:
        """Largest |x| of the cup."""
        return max(abs(step.state.x_m) for step in self.steps)

    @property
    def half_swings(self) -> int:
        """Stretches in which the ball swings in one direction, the last one included (count_half_swings)."""
        return count_half_swings(step.state.rate_rad_s for step in self.steps)


def swing_up(
    cart: CupCart,
    actor: SwingUpActor,
    goal: Goal,
    limiter: BrakingLimiter,
    *,
    rollout_s: float,
    seed: int,
    observe: Callable[[CartStep], None] = lambda step: None,
) -> SwingUpRollout:
    """Swing from rest until ``goal`` is observed to be reached, or for ``rollout_s``; raises HardwareError of the line.

    The actor is given the state in which its action will be carried out, on the model's rope and in the model's time,
    so that neither a delay of the arm nor another rope shows in it. ``observe`` is called after every period.
    """
    step = cart.begin(seed)
    steps = [step]
    observe(step)
    while not goal.reached(step.state):
        if step.t_s >= rollout_s:
            return SwingUpRollout("timeout", tuple(steps))
        step = cart.step(actor.act(cart.predict_state(step.state), step.t_s / cart.time_scale), limiter)
        steps.append(step)
        observe(step)
    return SwingUpRollout("goal", tuple(steps))
