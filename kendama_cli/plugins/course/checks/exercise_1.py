"""Grades exercise 1: a swing, looked at."""

from __future__ import annotations

import numpy as np

from kendama_cli.api import swing
from kendama_cli.plugins.course.work import Work, array_of, require, require_close
from kendama_cli.schema.arrays import Array

GRAVITY_M_S2 = 9.81


def velocity(work: Work) -> None:
    """Check that central differences are exact on parabolas, at uneven times too if they weigh them."""
    t_s = np.linspace(0.0, 1.0, 41)
    y = 0.3 - 0.5 * t_s + 2.0 * t_s**2
    found = array_of("velocity(t_s, y)", work.function("velocity")(t_s, y), t_s.shape)
    hint = (
        "take the difference of the two neighbours over their distance in time, (y[k+1] - y[k-1]) / (t[k+1] - t[k-1])"
    )
    require_close("velocity(t_s, y)[1:-1]", found[1:-1], (-0.5 + 4.0 * t_s)[1:-1], 1e-9, hint)
    ends = "at the ends take the difference to the only neighbour"
    require_close("velocity(t_s, y)[0]", found[0], (y[1] - y[0]) / t_s[1], 0.06, ends)
    three = np.column_stack([y, -y, 2.0 * y])
    several = array_of("velocity of (n, 3) places", work.function("velocity")(t_s, three), three.shape)
    require_close("velocity of (n, 3) places", several[1:-1, 2], 2.0 * found[1:-1], 1e-9, "go along the times: axis=0")


def moving(work: Work) -> None:
    """Check against a motion with rest before and after it, whose ends are known."""
    t_s = np.arange(0.0, 2.0, 0.01)
    for begins_s, takes_s in ((0.40, 0.8), (0.73, 1.0)):
        share = np.clip((t_s - begins_s) / takes_s, 0.0, 1.0)
        speed = 0.25 * np.sin(np.pi * share) * np.pi / takes_s
        at = np.column_stack([0.25 * (1 - np.cos(np.pi * share)), 0 * t_s, 0 * t_s])
        above = np.flatnonzero(speed > 0.2)
        found = work.function("moving")(t_s, at, 0.2)
        pair = array_of("moving(t_s, position_m, 0.2)", found, (2,))
        hint = "the first and the last time at which the speed is above threshold_m_s; nothing before, nothing after"
        require_close("moving(...)", pair, [t_s[above[0]], t_s[above[-1]]], 0.011, hint)


def noise(work: Work) -> None:
    """Check the formula against measured noise."""
    rng = np.random.default_rng(11)
    for sigma_m, step_s in ((0.0005, 0.01), (0.002, 0.025)):
        y = rng.normal(0.0, sigma_m, 200_000)
        real = float(np.std((y[2:] - 2.0 * y[1:-1] + y[:-2]) / step_s**2))
        found = work.function("acceleration_noise")(sigma_m, step_s)
        hint = "variances add: factors 1, -2 and 1 make 1 + 4 + 1, and h^2 stands below (drawn from 200 000 samples)"
        require_close(f"acceleration_noise({sigma_m}, {step_s})", found, real, 0.02 * real, hint)


def ball_angle(work: Work) -> None:
    """Check against a fine Runge-Kutta solution, and that a cup at rest leaves the ball at rest."""
    angle = work.function("ball_angle")
    t_s = np.arange(0.0, 3.0, 0.001)
    still = array_of("ball_angle with a cup at rest", angle(t_s, 0.0 * t_s, 0.40), t_s.shape)
    require(float(np.abs(still).max()) < 1e-9, "a ball that hangs under a cup at rest stays there; yours moves")
    for rope_m, strength, pace in ((0.40, 2.0, 4.9), (0.30, -3.0, 3.0)):
        found = array_of("ball_angle(...)", angle(t_s, strength * np.sin(pace * t_s), rope_m), t_s.shape)
        wanted = _runge_kutta(t_s, strength, pace, rope_m)
        hint = (
            "phi'' = -(g sin phi + a cos phi) / l, the rate first and the angle by the new rate; mind the signs and l"
        )
        require_close(f"ball_angle(..., rope_m={rope_m})", found, wanted, 0.05, hint)


def _runge_kutta(t_s: Array, strength: float, pace: float, rope_m: float) -> Array:
    def slope(t: float, y: Array) -> Array:
        cup = strength * np.sin(pace * t)
        return np.array([y[1], -(GRAVITY_M_S2 * np.sin(y[0]) + cup * np.cos(y[0])) / rope_m])

    y, made = np.zeros(2), np.zeros(len(t_s))
    for k in range(len(t_s) - 1):
        t, h = t_s[k], t_s[k + 1] - t_s[k]
        one = slope(t, y)
        two = slope(t + h / 2, y + h / 2 * one)
        three = slope(t + h / 2, y + h / 2 * two)
        y = y + h / 6 * (one + 2 * two + 2 * three + slope(t + h, y + h * three))
        made[k + 1] = y[0]
    return made


def whole_swings(work: Work) -> None:
    """Check that the figures are those of the student's own swings."""
    played = [swing(one.t_s, one.position_m) for one in work.value("swings")]
    highest = max(float((one.ball_m - one.cup_m)[:, 2].max()) for one in played)
    hint = "the ball's height over the cup's tie point: (ball_m - cup_m)[:, 2], its maximum over all swings"
    require_close("highest_m", work.number("highest_m"), highest, 0.002, hint)
    share = float(np.mean([one.caught for one in played]))
    require_close("caught_share", work.number("caught_share"), share, 1e-6, "the mean of 'caught' over all swings")


CHECKS = {1: velocity, 2: moving, 3: noise, 4: ball_angle, 5: whole_swings}
