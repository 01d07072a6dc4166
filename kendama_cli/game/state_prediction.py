"""What a policy is given on another body: the state in which its command will act, in the model's size and time."""

from __future__ import annotations

import math
from collections.abc import Sequence

from kendama_cli.learning.state import SwingState
from kendama_cli.physics.taut_rope import TautRope


def predict_state(
    state: SwingState,
    reference: tuple[float, float],
    coming_m_s2: Sequence[float],
    *,
    period_s: float,
    rope: TautRope,
    gravity_m_s2: float,
) -> SwingState:
    """``state`` once the accelerations ``coming_m_s2``, commanded but not yet carried out, have passed.

    The cup will be where its ``reference`` (position, velocity) is now. The ball swings on about the accelerated tie
    point with the rope taut (TautRope), by semi-implicit Euler with one step per control period.
    """
    angle, rate = state.angle_rad, state.rate_rad_s
    for a in coming_m_s2:
        rate += rope.acceleration_rad_s2(angle, rate, a, gravity_m_s2) * period_s
        angle += rate * period_s
    return SwingState(*reference, math.remainder(angle, 2.0 * math.pi), rate)


def scaled_to_model_rope(state: SwingState, rope_scale: float) -> SwingState:
    """The same swing on the model's rope, where the real one is ``rope_scale`` times as long.

    With lengths divided by s and times by sqrt(s) the equations of motion stay as they are under the same gravity
    and the same accelerations, so that what was learned on the one holds on the other.
    """
    root = math.sqrt(rope_scale)
    x, v, angle, rate = state
    return SwingState(x / rope_scale, v / root, angle, rate * root)
