"""The cart: what it sends, what it takes for its delays, and the state that the next command meets."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kendama_cli.control.cup_cart import CupCart, predict_state, scaled_to_model_rope
from kendama_cli.learning.state import SwingState
from kendama_cli.motion.braking import BrakingLimiter
from kendama_cli.physics.taut_rope import TautRope
from tests.control.cart_robot import Straight
from tests.control.observed_games import GAME

H, ARM_LATE, CUP_LATE, BEGUN_S, SCALE = 0.004, 2, 3, 7.0, 1.1


class Late:
    """A robot whose joint is two periods late and whose cup is seen one period later; an estimator that looks on."""

    period_s = H

    def reset(self, position_rad: np.ndarray, seed: int) -> Any:
        self.sent, self.t_s, self.told = [position_rad] * (1 + CUP_LATE), BEGUN_S, []
        return self._answer()

    def exchange(self, command: Any) -> Any:
        self.sent.append(command.position_rad)
        self.t_s += H
        return self._answer()

    def _answer(self) -> Any:
        state = SimpleNamespace(position_rad=self.sent[-1 - ARM_LATE], x_m=float(self.sent[-1 - CUP_LATE][0]))
        return SimpleNamespace(t_s=self.t_s, state=state)

    def begin(self) -> None:
        self.told = []

    def update(self, state: Any, acceleration_m_s2: float) -> SwingState:
        self.told.append(acceleration_m_s2)
        return SwingState(state.x_m, 0.1, 0.5, -2.0)


def test_a_cart_integrates_what_it_is_allowed_and_knows_how_late_arm_and_cup_are() -> None:
    robot: Any = Late()
    cart = CupCart(robot, Straight(), robot, GAME, SCALE)  # type: ignore[arg-type]
    limiter, rng = BrakingLimiter(0.3, 2.0, 7.2, 8.0, H), np.random.default_rng(10029)
    first = cart.begin(3, 0.05)
    assert (first.t_s, first.acceleration_m_s2, cart.x_m, cart.delay_s) == (0.0, 0.0, 0.05, 0.0)
    x, v, made = 0.05, 0.0, []
    for k in range(1, 400):
        wanted = 12.0 * np.sin(0.05 * k) + rng.normal()
        step = cart.step(wanted, limiter)
        made.append(limiter.limit(wanted, x, v))
        x, v = x + H * v + 0.5 * H * H * made[-1], v + H * made[-1]
        assert (cart.x_m, cart.velocity_m_s) == pytest.approx((x, v))
        assert step.acceleration_m_s2 == pytest.approx(made[-1])
        assert (step.t_s, step.tilt_rad) == pytest.approx((H * k, 0.0))
        assert robot.sent[-1] == pytest.approx([x])
    assert cart.arm_lag_s == pytest.approx(ARM_LATE * H, rel=0.05)
    assert cart.delay_s == pytest.approx(CUP_LATE * H, rel=0.05)
    assert robot.told[-50:] == pytest.approx(made[-50 - CUP_LATE : -CUP_LATE])
    seen = SwingState(0.0, 0.1, 0.5, -2.0)
    rope = TautRope.of(GAME, SCALE)
    coming = predict_state(seen, (x, v), made[-CUP_LATE:], period_s=H, rope=rope, gravity_m_s2=GAME.gravity_m_s2)
    assert cart.predict_state(seen) == pytest.approx(scaled_to_model_rope(coming, SCALE))
    assert cart.time_scale == pytest.approx(SCALE**0.5)
    again = cart.begin(3)
    assert (again.t_s, cart.x_m, cart.velocity_m_s, cart.delay_s, cart.arm_lag_s) == (0.0, 0.0, 0.0, 0.0, 0.0)
