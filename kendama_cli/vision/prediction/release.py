"""Random releases: a ball swings on a taut rope, the cup yields, the ball flies free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import ConfigError
from kendama_cli.physics.free_fall import runge_kutta
from kendama_cli.physics.taut_rope import TautRope
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.prediction.free_flight import FreeFlight
from kendama_cli.vision.settings import ReleaseSettings

TAUT_STEP_S = 1e-3
CHECKED_STEP_S = 2e-3
TRIES = 10_000


@dataclass(frozen=True)
class Release:
    """One flight: the ball swings until time 0 and then falls free until it crosses the rim plane at ``crossing_s``.

    ``taut_s`` (n,) and ``taut_ball_m``, ``taut_cup_m`` (n, 3) are the swing before, ``taut_s`` ending at 0.
    """

    flight: FreeFlight
    start_m: Array
    velocity_m_s: Array
    crossing_s: float
    cup_m: Array
    cup_velocity_m_s: Array
    cup_acceleration_m_s2: Array
    taut_s: Array
    taut_ball_m: Array
    taut_cup_m: Array

    def ball_m(self, t_s: float) -> Array:
        """Return the ball's centre (3,)."""
        if t_s < 0:
            return _interpolate(t_s, self.taut_s, self.taut_ball_m)
        return self.flight.position_m(self.start_m, self.velocity_m_s, t_s)

    def tie_m(self, t_s: float) -> Array:
        """Return the rope's tie point (3,): the cup."""
        if t_s < 0:
            return _interpolate(t_s, self.taut_s, self.taut_cup_m)
        return _cup_after(self.cup_m, self.cup_velocity_m_s, self.cup_acceleration_m_s2, np.array(t_s))

    @property
    def crossing_m(self) -> Array:
        """Return the position (3,) at which the ball's centre crosses the rim plane."""
        return self.flight.position_m(self.start_m, self.velocity_m_s, self.crossing_s)


def draw_release(
    rng: np.random.Generator, settings: ReleaseSettings, game: GameSettings, taut_duration_s: float
) -> Release:
    """Sample one release that ends a swing-up, the cup at rest height with its tie point at z = 0.

    Drawn uniformly, and again until all hold: ball angle 100..150 deg and rate 2..7 rad/s at the release, the cup
    pulled sideways at 2..8 m/s^2 (the rope's tension on the ball then is at least 6 m/s^2) and then pushed back
    to follow the ball, apex within the settings' limits, rope slack until the crossing, and the crossing within
    0.25 m of the cup.
    """
    flight = FreeFlight(np.array([0.0, 0.0, -game.gravity_m_s2]), *game.drag_per_mass)
    rope, g = TautRope.of(game), game.gravity_m_s2
    for _ in range(TRIES):
        side = float(rng.choice([-1.0, 1.0]))
        phi, rate = side * np.deg2rad(rng.uniform(100, 150)), side * rng.uniform(2.0, 7.0)
        acceleration, cup_x = -side * rng.uniform(2.0, 8.0), rng.uniform(-1, 1) * settings.cup_travel_m
        cup_speed, lateral = rng.uniform(-0.5, 0.5), rng.uniform(-1, 1) * settings.lateral_m_s
        ball = rope.ball(phi, rate)
        cup, cup_velocity = np.array([cup_x, 0.0, 0.0]), np.array([cup_speed, 0.0, 0.0])
        start = cup + np.array([ball.across_m, 0.0, ball.above_m])
        velocity = cup_velocity + np.array([ball.across_m_s, lateral, ball.above_m_s])
        along_rope = rope.tension_m_s2(phi, rate, acceleration, g)
        apex = start[2] + max(velocity[2], 0.0) ** 2 / (2 * g) - game.cup.rim_m
        if along_rope < 6.0 or velocity[2] <= 0 or not settings.apex_low_m <= apex <= settings.apex_high_m:
            continue
        crossing_s = flight.descent_s(start, velocity, game.cup.rim_m)
        if crossing_s is None:
            continue
        meeting = flight.position_m(start, velocity, crossing_s)
        follow = 2 * (meeting - cup - cup_velocity * crossing_s) / crossing_s**2 * [1.0, 0.0, 0.0]
        if abs(meeting[0] - cup_x) > 0.25 or abs(follow[0]) > 8.0:
            continue
        t = np.arange(0.0, crossing_s, CHECKED_STEP_S)
        apart = flight.position_m(start, velocity, t) - _cup_after(cup, cup_velocity, follow, t)
        if any(rope.cup.path_length_m(*row) > rope.length_m + 1e-9 for row in apart.tolist()):
            continue
        swing = _Swing(cup, cup_velocity, np.array([acceleration, 0.0, 0.0]), phi, rate, lateral)
        taut = swing.before(game, taut_duration_s)
        return Release(flight, start, velocity, crossing_s, cup, cup_velocity, follow, *taut)
    raise ConfigError(
        "predict.release.apex_low_m",
        f"'predict.release': an apex {settings.apex_low_m}..{settings.apex_high_m} m over the rim is out of reach of a "
        f"rope of {rope.length_m} m ({TRIES} draws); widen predict.release.apex_low_m and apex_high_m",
    )


@dataclass(frozen=True)
class _Swing:
    """The taut rope at the release: the cup's motion, the ball's angle and rate, its sideways speed."""

    cup_m: Array
    cup_velocity_m_s: Array
    cup_acceleration_m_s2: Array
    angle_rad: float
    rate_rad_s: float
    lateral_m_s: float

    def before(self, game: GameSettings, duration_s: float) -> tuple[Array, Array, Array]:
        """Times (n,) up to 0, ball and tie point (n, 3) during ``duration_s`` before the release.

        The taut pendulum, backward by RK4; sideways the ball drifts.
        """
        rope, g, acceleration = TautRope.of(game), game.gravity_m_s2, float(self.cup_acceleration_m_s2[0])
        n = max(int(np.ceil(duration_s / TAUT_STEP_S)), 1)

        def slope(state: Array) -> Array:
            angle, rate = state.tolist()
            return np.array([rate, rope.acceleration_rad_s2(angle, rate, acceleration, g)])

        states = [np.array([self.angle_rad, self.rate_rad_s])]
        for _ in range(n):
            states.append(runge_kutta(slope, states[-1], -TAUT_STEP_S))
        balls = [rope.ball(*state.tolist()) for state in states[::-1]]
        t = np.arange(-n, 1, dtype=np.float64) * TAUT_STEP_S
        tie = _cup_after(self.cup_m, self.cup_velocity_m_s, self.cup_acceleration_m_s2, t)
        ball = tie + [[one.across_m, 0.0, one.above_m] for one in balls]
        ball[:, 1] += self.lateral_m_s * t
        return t, ball, tie


def _cup_after(cup: Array, velocity: Array, acceleration: Array, t: NDArray[np.float64]) -> Array:
    return np.asarray(cup + t[..., None] * velocity + t[..., None] ** 2 / 2 * acceleration)


def _interpolate(t_s: float, t: Array, values: Array) -> Array:
    return np.array([np.interp(t_s, t, values[:, axis]) for axis in range(values.shape[1])])
