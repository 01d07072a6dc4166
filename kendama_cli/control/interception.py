"""Interception: the cup's motion along its line to where the ball comes down."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class InterceptionPlan:
    """Acceleration that runs linearly from ``first_m_s2`` at ``start_s`` to ``last_m_s2`` at ``end_s``."""

    start_s: float
    end_s: float
    first_m_s2: float
    last_m_s2: float
    speed_m_s: float
    """Speed at the end."""

    def acceleration_m_s2(self, t_s: float) -> float:
        """Return the acceleration at ``t_s``, constant outside that time."""
        fraction = min(max((t_s - self.start_s) / (self.end_s - self.start_s), 0.0), 1.0)
        return self.first_m_s2 + fraction * (self.last_m_s2 - self.first_m_s2)


def plan_interception(
    *, displacement_m: float, velocity_m_s: float, desired_m_s: float, start_s: float, end_s: float, limit_m_s2: float
) -> InterceptionPlan:
    """Cover ``displacement_m`` until ``end_s`` with least integral of a^2, at ``desired_m_s`` as the limit allows.

    From (x, v) to (x + d, w) in T that is a cubic with a0 = 6 d / T^2 - (4 v + 2 w) / T at its beginning and
    aT = -6 d / T^2 + (2 v + 4 w) / T at its end. w is moved from the desired speed only as far as |a0| <= limit and,
    if both are possible, |aT| <= limit need.
    """
    v, time = velocity_m_s, end_s - start_s
    even = 6.0 * displacement_m / time
    half = 0.5 * limit_m_s2 * time
    low, high = 0.5 * even - 2.0 * v - half, 0.5 * even - 2.0 * v + half
    late_low, late_high = 0.25 * even - 0.5 * v - 0.5 * half, 0.25 * even - 0.5 * v + 0.5 * half
    if max(low, late_low) <= min(high, late_high):
        low, high = max(low, late_low), min(high, late_high)
    speed = min(max(desired_m_s, low), high)
    first = (even - 4.0 * v - 2.0 * speed) / time
    last = (-even + 2.0 * v + 4.0 * speed) / time
    return InterceptionPlan(start_s, end_s, first, min(max(last, -limit_m_s2), limit_m_s2), speed)
