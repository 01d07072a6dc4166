"""How a catch ended, from what the robot's sensors report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.game.cup_cart import CartStep

HELD_S = 0.25
"""A ball in the cup for so long stays there: a bounce that leaves it is over by then."""
BLOW_S = 0.08
"""The blow of the ball is sought this long about the predicted catch."""
BLOW_N = 2.0
"""A smaller change of the wrist's force from one reading to the next is the arm's own motion."""


@dataclass(frozen=True)
class CatchOutcome:
    """What the ball sensor says in the end, since when it has said so, and the largest blow that the wrist felt.

    The blow is the largest change of the wrist's force from one control period to the next, about the predicted catch.
    """

    caught: bool
    since_s: float
    blow_n: float

    @property
    def words(self) -> str:
        """The outcome in words."""
        if self.caught:
            return "caught"
        return "struck the cup and left" if self.blow_n > BLOW_N else "passed by"


def held(steps: Sequence[CartStep]) -> bool:
    """Whether the ball sensor has said for ``HELD_S`` that the ball is in the cup."""
    if not steps or not steps[-1].exchange.state.caught:
        return False
    return steps[-1].t_s - _since_s(steps) >= HELD_S


def catch_outcome(steps: Sequence[CartStep], catch_s: float) -> CatchOutcome:
    """How the control periods after the swing-up (one at least) ended; the catch was predicted for ``catch_s``."""
    forces = np.array([step.exchange.state.wrist_wrench[:3] for step in steps])
    times = np.array([step.t_s for step in steps])
    near = np.abs(times[1:] - catch_s) <= BLOW_S
    changes = np.linalg.norm(np.diff(forces, axis=0), axis=1)[near]
    return CatchOutcome(steps[-1].exchange.state.caught, _since_s(steps), float(changes.max()) if len(changes) else 0.0)


def _since_s(steps: Sequence[CartStep]) -> float:
    """Since when the ball sensor says what it says in the end."""
    now = steps[-1].exchange.state.caught
    since = steps[-1].t_s
    for step in reversed(steps):
        if step.exchange.state.caught != now:
            break
        since = step.t_s
    return since
