"""The classical method of fourth order for ordinary differential equations (W. Kutta, Z. Math. Phys. 46, 1901)."""

from __future__ import annotations

from collections.abc import Callable

from kendama_cli.schema.arrays import Array


def runge_kutta(slope: Callable[[Array], Array], state: Array, step_s: float) -> Array:
    """Return the solution of y' = ``slope``(y) at ``step_s`` after ``state`` (...), to step^5."""
    k1 = slope(state)
    k2 = slope(state + 0.5 * step_s * k1)
    k3 = slope(state + 0.5 * step_s * k2)
    k4 = slope(state + step_s * k3)
    return state + step_s / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
