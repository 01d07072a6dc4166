"""How a catch ended, from what the robot's sensors report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.control.cup_cart import CartStep
from kendama_cli.physics.rim_crossing import SampledWays, is_caught
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

HELD_S = 0.25
"""A ball in the cup for so long stays there: a bounce that leaves it is over by then."""
BLOW_S = 0.08
"""The blow of the ball is sought this long about the predicted catch."""
BLOW_N = 2.0
"""A smaller change of the wrist's force from one reading to the next is the arm's own motion."""


@dataclass(frozen=True)
class CatchOutcome:
    """The catch, what the ball sensor says in the end, since when it has said so, and the largest blow of the wrist.

    ``caught`` is as in RolloutResult; where the robot tracks no ball that came down, the sensor decides alone. The blow
    is the largest change of the wrist's force from one control period to the next, about the predicted catch.
    """

    caught: bool
    in_cup: bool
    since_s: float
    blow_n: float

    @property
    def words(self) -> str:
        """The outcome in words."""
        if self.caught:
            return "caught"
        if self.in_cup:
            return "in the cup, but not by the planned catch"
        return "struck the cup and left" if self.blow_n > BLOW_N else "passed by"


def held(steps: Sequence[CartStep]) -> bool:
    """Whether the ball sensor has said for ``HELD_S`` that the ball is in the cup."""
    if not steps or not steps[-1].exchange.state.caught:
        return False
    return steps[-1].t_s - _since_s(steps) >= HELD_S


def sensed_catch(in_cup: bool, miss_m: tuple[float, float] | None, game: GameSettings) -> bool:
    """Return True if the ball sensor says ``in_cup`` and the tracked descent, where it is known, led into the mouth."""
    return in_cup and (miss_m is None or is_caught(in_cup, miss_m, game.cup.radius_m))


def catch_outcome(
    steps: Sequence[CartStep], catch_s: float, direction: Array, game: GameSettings, since_s: float
) -> CatchOutcome:
    """Return how the control periods after the swing-up (one at least) ended; the catch was predicted for ``catch_s``.

    The cup leans along ``direction`` (3,); descents count from ``since_s`` on.
    """
    lean = np.array([step.tilt_rad for step in steps])[:, None]
    axis = np.sin(lean) * direction + np.cos(lean) * [0.0, 0.0, 1.0]
    states = [step.exchange.state for step in steps]
    cup_m, ball_m = (np.array([getattr(one, f"{body}_in_world_m") for one in states]) for body in ("cup", "ball"))
    miss_m = SampledWays(np.array([step.t_s for step in steps]), cup_m, axis, ball_m).miss_m(game, since_s)
    forces = np.array([step.exchange.state.wrist_wrench[:3] for step in steps])
    times = np.array([step.t_s for step in steps])
    near = np.abs(times[1:] - catch_s) <= BLOW_S
    changes = np.linalg.norm(np.diff(forces, axis=0), axis=1)[near]
    caught, blow_n = sensed_catch(states[-1].caught, miss_m, game), float(changes.max()) if len(changes) else 0.0
    return CatchOutcome(caught, states[-1].caught, _since_s(steps), blow_n)


def _since_s(steps: Sequence[CartStep]) -> float:
    """Since when the ball sensor says what it says in the end."""
    now = steps[-1].exchange.state.caught
    since = steps[-1].t_s
    for step in reversed(steps):
        if step.exchange.state.caught != now:
            break
        since = step.t_s
    return since
