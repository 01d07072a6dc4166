"""The kendama from a free swing under a cup at rest: the fit of rope and drag."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kendama_cli.artifacts.kendama_model import KendamaModel
from kendama_cli.errors import StageError
from kendama_cli.physics.free_fall import drag_over_speed, runge_kutta
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

LEAST_RAD, LEAST_S = math.radians(60.0), 30.0
"""From less the drag cannot be told: fits of 30 deg over 20 s were 64 % off at 3 m/s, of 60 deg over 30 s 3 %."""
MOST_RAD = math.radians(88.0)
"""Above it the rope goes round the cup's edge: the fit begins when the swing has become smaller."""
WINDOWS_S = (3.0, 8.0, 20.0)
"""The fit goes over ever longer parts, so that it never has to find a phase that is whole turns off."""
STEP_S = 0.0085
ROUNDS = 12
SMALL = np.array([1e-5, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5, 1e-5])
"""Differences by which the parameters are varied: length, k1 / m, k2 / m, angle, rate, and the pivot's x and z."""


@dataclass(frozen=True)
class FreeSwing:
    """A ball about a pivot at rest: ``t_s`` (n,) and its places in the plane of the swing, across and up (n, 2)."""

    t_s: Array
    place_m: Array

    @property
    def duration_s(self) -> float:
        """Return the duration of the swing in the recording [s]."""
        return float(self.t_s[-1] - self.t_s[0])


def swing_in_its_plane(t_s: Array, position_m: Array) -> FreeSwing:
    """Return the swing of a track (n, 3) whose z points up, along the horizontal direction in which it moves most."""
    seen = np.isfinite(position_m).all(axis=1)
    times, positions = np.asarray(t_s)[seen], np.asarray(position_m)[seen]
    level = positions[:, :2] - positions[:, :2].mean(axis=0)
    along = np.linalg.svd(level, full_matrices=False)[2][0] if len(level) > 2 else np.array([1.0, 0.0])
    return FreeSwing(times - times[0], np.column_stack([level @ along, positions[:, 2]]))


@dataclass(frozen=True)
class KendamaFit:
    """The kendama, and its free swing about the fitted pivot: times (n,), places (n, 2) as seen and as fitted."""

    kendama: KendamaModel
    t_s: Array
    seen_m: Array
    fitted_m: Array


def measure_kendama(swing: FreeSwing, game: GameSettings) -> KendamaFit:
    """Return the rope and drag of the pendulum

        phi'' = -(g / l) sin phi - 2 (l' / l) phi' - (k1 + k2 l |phi'|) phi' / m - Kd (l' / phi')^2 phi' / (m l^2),

    x = px + l sin phi, z = pz - l cos phi, on a rope that the ball stretches: l = l0 + m (g cos phi + l0 phi'^2) / Ks
    and l' = -3 (m g / Ks) sin phi phi'. By least squares (Gauss and Newton) over l0, drag, start and pivot; the ball's
    mass and the rope's stiffness and damping are the game's. The standard deviations allow for residuals that hang
    together in time. Raises StageError for a swing that is too small or too short to tell, or that no pendulum fits.
    """
    swing = _below_the_edge(swing)
    centre, radius = _circle(swing.place_m)
    angles = np.unwrap(np.arctan2(swing.place_m[:, 0] - centre[0], centre[1] - swing.place_m[:, 1]))
    amplitude = float(np.abs(angles[swing.t_s < 2.0]).max(initial=0.0))
    if amplitude < LEAST_RAD:
        raise StageError(
            f"the free swing is too small to measure the drag: it starts at {math.degrees(amplitude):.0f} deg; "
            f"allowed: from {math.degrees(LEAST_RAD):.0f} deg (from 30 deg nothing can be known); "
            "let the ball swing higher"
        )
    if swing.duration_s < LEAST_S:
        raise StageError(
            f"the free swing is too short to measure the drag: {swing.duration_s:.1f} s; allowed: from {LEAST_S:g} s "
            f"below {math.degrees(MOST_RAD):.0f} deg; let it swing longer"
        )
    k1, k2 = game.drag_per_mass
    early = swing.t_s < 0.15
    rate, angle = np.polyfit(swing.t_s[early], angles[early], 2)[1:]
    values = np.array([radius, k1, k2, angle, rate, *centre])
    for window_s in (*WINDOWS_S, math.inf):
        part = swing.t_s <= window_s
        fit = _fitted(FreeSwing(swing.t_s[part], swing.place_m[part]), values, game)
        values = fit.values
    mass = game.ball.mass_kg
    covariance = fit.covariance
    kendama = KendamaModel(
        rope_m=float(values[0]),
        rope_sigma_m=math.sqrt(covariance[0, 0]),
        linear_n_s_m=mass * float(values[1]),
        quadratic_n_s2_m2=mass * float(values[2]),
        drag_covariance=mass**2 * covariance[1:3, 1:3],
        amplitude_rad=amplitude,
        duration_s=swing.duration_s,
        rms_m=fit.rms_m,
    )
    pivot, fitted = values[5:], played(values[:, None], swing.t_s, game)[:, :, 0]
    return KendamaFit(kendama, swing.t_s, swing.place_m - pivot, fitted - pivot)


def played(values: Array, t_s: Array, game: GameSettings) -> Array:
    """Return the places (n, 2, m) at ``t_s`` (n,) of pendulums with the parameters (7, m)."""
    untensioned, k1, k2, angle, rate, px, pz = values
    mass, gravity, rope = game.ball.mass_kg, game.gravity_m_s2, game.rope
    soft = mass / rope.stiffness_n_m
    lost = rope.damping_n_s_m * (3.0 * soft * gravity) ** 2 / mass

    def stretched(phi: Array, turning: Array) -> Array:
        return np.asarray(untensioned + soft * (gravity * np.cos(phi) + untensioned * turning * turning))

    def slope(state: Array) -> Array:
        phi, turning = state
        length, sine = stretched(phi, turning), np.sin(phi)
        drag = drag_over_speed(k1, k2, length * np.abs(turning)) + lost * sine * sine / (length * length)
        bend = (6.0 * soft * gravity * turning * turning - gravity) * sine / length - drag * turning
        return np.stack([turning, bend])

    positions = np.empty((len(t_s), 2, values.shape[1]))
    state, now = np.stack([angle, rate]), 0.0
    for i, t in enumerate(t_s.tolist()):
        steps = math.ceil((t - now) / STEP_S)
        for _ in range(steps):
            state = runge_kutta(slope, state, (t - now) / steps)
        now = t
        phi = state[0]
        length = stretched(*state)
        positions[i] = px + length * np.sin(phi), pz - length * np.cos(phi)
    return positions


@dataclass(frozen=True)
class _Fit:
    values: Array
    covariance: Array
    rms_m: float


def _fitted(swing: FreeSwing, values: Array, game: GameSettings) -> _Fit:
    for _ in range(ROUNDS):
        varied = values[:, None] + np.column_stack([np.zeros(7), np.diag(SMALL)])
        positions = played(varied, swing.t_s, game)
        left = (swing.place_m - positions[:, :, 0]).ravel()
        slopes = ((positions[:, :, 1:] - positions[:, :, :1]) / SMALL).reshape(-1, 7)
        scale = np.linalg.norm(slopes, axis=0)
        step = np.linalg.lstsq(slopes / scale, left, rcond=None)[0] / scale
        values = values + step
        if not (np.isfinite(values).all() and values[0] > 0):
            raise StageError("no pendulum fits this swing: the pivot must be at rest, and the track that of the ball")
        if float(np.abs(step / SMALL).max()) < 0.1:
            break
    rms = math.sqrt(float(left @ left) / max(len(left) - 7, 1))
    if rms > 0.1 * values[0]:
        raise StageError(
            f"no pendulum fits this swing: {1e3 * rms:.0f} mm remain; the pivot must be at rest, and the track that "
            "of the ball"
        )
    rows = left.reshape(-1, 2)
    together = max(float((rows[1:] * rows[:-1]).sum() / (rows * rows).sum()), 0.0)
    inflated = rms**2 * (1.0 + together) / (1.0 - min(together, 0.99))
    covariance = inflated * np.linalg.inv((slopes / scale).T @ (slopes / scale)) / np.outer(scale, scale)
    return _Fit(values, np.asarray(covariance), rms)


def _below_the_edge(swing: FreeSwing) -> FreeSwing:
    """Return the part of the swing from where it stays below MOST_RAD; raises StageError if there is none."""
    if len(swing.t_s) < 50:
        raise StageError(f"the free swing has {len(swing.t_s)} samples; allowed: from 50, over {LEAST_S:g} s at least")
    centre, _ = _circle(swing.place_m)
    angle = np.abs(np.arctan2(swing.place_m[:, 0] - centre[0], centre[1] - swing.place_m[:, 1]))
    above = np.flatnonzero(angle > MOST_RAD)
    first = int(above[-1]) + 1 if len(above) else 0
    t_s = swing.t_s[first:]
    return FreeSwing(t_s - t_s[:1], swing.place_m[first:])


def _circle(place_m: Array) -> tuple[Array, float]:
    """Fit centre (2,) and radius of the circle through positions (n, 2), by linear least squares."""
    design = np.column_stack([2 * place_m, np.ones(len(place_m))])
    found = np.linalg.lstsq(design, (place_m**2).sum(axis=1), rcond=None)[0]
    return found[:2], float(math.sqrt(max(found[2] + found[:2] @ found[:2], 1e-9)))
