"""The cup's motion along its line as the joints' motion, compiled."""

from __future__ import annotations

from kendama_cli.motion.even_spline import cubic, piece_at
from kendama_cli.system.compiled import Array, compiled


@compiled
def references(  # noqa: PLR0917 - plain numbers and arrays, as compiled code takes them
    pieces: Array, first_m: float, knot_m: float, cup: Array, acceleration_m_s2: float, period_s: float, out: Array
) -> None:
    """Move ``cup`` on, whose numbers are x and v, at a constant acceleration a; the joints at the end of every period.

        q' = q_x v,   q'' = q_x a + q_xx v^2

    ``pieces`` (4, k, n) are the coefficients of the cubics q(x), the highest power first, from ``first_m`` on, each
    ``knot_m`` long; beyond the ends the last ones go on. ``out`` (m, 3, n) holds q, q' and q'' at m instants.
    """
    for instant in range(out.shape[0]):
        cup[0] += cup[1] * period_s + 0.5 * acceleration_m_s2 * period_s * period_s
        cup[1] += acceleration_m_s2 * period_s
        x, v = cup
        k, u = piece_at(x, first_m, knot_m, pieces.shape[1])
        for i in range(out.shape[2]):
            a, b, c, d = pieces[0, k, i], pieces[1, k, i], pieces[2, k, i], pieces[3, k, i]
            out[instant, 0, i], slope, bend = cubic(a, b, c, d, u)
            out[instant, 1, i] = slope * v
            out[instant, 2, i] = slope * acceleration_m_s2 + bend * v * v
