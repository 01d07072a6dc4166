"""One game once more, under a referee's physics: the cup goes where it went, and the ball where the chain lets it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from kendama_cli.errors import SimulationError
from kendama_cli.physics.rim_crossing import SampledBody, is_caught, is_inside
from kendama_cli.plugins.mujoco.cross_check.chain import STEP_S, chain_model, hang
from kendama_cli.plugins.mujoco.cross_check.cup_track import CupTrack
from kendama_cli.plugins.mujoco.library import mujoco
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

HALVINGS = 2
"""A run that does not stay finite is tried again at half the step, so often."""
KEPT_S = 0.01
"""Spacing of the ball's path that is kept."""


@dataclass(frozen=True)
class Replay:
    """Game under the second physics: ``miss_m`` as in RolloutResult, None if the ball never fell through the rim.

    ``t_s`` (n,) and ``ball_m`` (n, 3) are the ball's path.
    """

    caught: bool
    miss_m: float | None
    t_s: Array
    ball_m: Array


def replay(
    game: GameSettings,
    body: SampledBody,
    track: CupTrack,
    ball_m: Array,
    since_s: float = 0.0,
    *,
    surface: bool = False,
    spin_hz: float = 0.0,
) -> Replay:
    """Carry the cup along ``track`` with the ball hanging at rest from ``ball_m`` (3,), on the chain in MuJoCo.

    ``surface`` and ``spin_hz`` are those of a Variation.
    ``since_s`` is when the crossing begins to count. Raises SimulationError where no step stays finite.
    """
    step_s = STEP_S
    for _ in range(HALVINGS + 1):
        model = chain_model(game, body, step_s, surface=surface)
        seen = _replayed(game, body, track, ball_m, since_s=since_s, model=model, spin_hz=spin_hz)
        if seen is not None:
            return seen
        step_s /= 2
    raise SimulationError("referee", 0.0, f"the referee's chain does not stay finite at steps of {2 * step_s:g} s")


def _replayed(
    game: GameSettings, body: SampledBody, track: CupTrack, ball_m: Array, *, since_s: float, model: Any, spin_hz: float
) -> Replay | None:
    mj, step_s = mujoco(), float(model.opt.timestep)
    way = track.carried(step_s)
    data, ball, centre = mj.MjData(model), model.body("ball").id, model.site("ball").id
    mass, inertia = float(model.body_mass[1]), float(model.body_inertia[1, 0])
    data.qpos[:3], data.qpos[3:7] = way.place_m[0], way.turn_wxyz[0]
    hang(model, data, ball_m, body.rope_m, spin_hz)
    (k1, k2), rim, radius = body.drag, game.cup.rim_m, game.ball.radius_m
    pushes = np.hstack([mass * way.acceleration_m_s2, inertia * way.turning_rad_s2])
    rates = np.hstack([way.velocity_m_s, way.rate_rad_s])
    poses = np.hstack([way.place_m, way.turn_wxyz])
    kept, every = [], round(KEPT_S / step_s)
    miss: float | None = None
    above = False
    for k in range(len(way.t_s) - 1):
        data.qpos[:7], data.qvel[:6], data.qfrc_applied[:6] = poses[k], rates[k], pushes[k]
        vx, vy, vz = data.sensordata.tolist()
        drag = k1 + k2 * math.sqrt(vx * vx + vy * vy + vz * vz)
        data.xfrc_applied[ball, :3] = (-drag * vx, -drag * vy, -drag * vz)
        mj.mj_step(model, data)
        place = data.site_xpos[centre]  # of the step's beginning
        height = float(place[2] - way.place_m[k, 2])
        if above and miss is None and height <= rim + radius and way.t_s[k] >= since_s:
            vx, _, vz = data.sensordata.tolist()
            down = max(float(way.velocity_m_s[k, 2]) - vz, 1e-3)
            aside = vx - float(way.velocity_m_s[k, 0])
            miss = float(place[0] - way.place_m[k, 0]) + aside * (height - rim) / down
        above = height > rim + radius
        if k % every == 0:
            if not math.isfinite(height):
                return None
            kept.append((way.t_s[k], *place.tolist()))
    if not np.isfinite(data.qpos).all() or data.warning[mj.mjtWarning.mjWARN_BADQACC].number:
        return None
    path = np.array(kept)
    in_cup = _inside(game, data, centre)
    caught = is_caught(in_cup, None if miss is None else (miss, 0.0), game.cup.radius_m)
    return Replay(caught, miss, path[:, 0], path[:, 1:])


def _inside(game: GameSettings, data: Any, centre: int) -> bool:
    """Return True if the ball's centre is in the cup, below the rim."""
    turn, apart = data.xmat[1].reshape(3, 3), data.site_xpos[centre] - data.xpos[1]
    return is_inside(turn.T @ apart, game.cup)
