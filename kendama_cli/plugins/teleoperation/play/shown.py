"""Data for the page: positions, the table and the tries."""

from __future__ import annotations

import platform
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.plugins.teleoperation.play.settings import PlaySettings
from kendama_cli.plugins.teleoperation.play.table import PlayTable
from kendama_cli.plugins.teleoperation.play.tries import TryFolder
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

SLOW = 0.25
"""Speed at which a try is shown again."""
SHOW_EVERY = 2
"""Of the samples kept, every second is shown again: 125 Hz."""


def state(table: PlayTable, t_s: float) -> dict[str, Any]:
    """Return the positions of cup and ball after the hand's sample of its time ``t_s``."""
    x, _, z, tilt = table.world.place.tolist()
    ball = table.world.ball
    return {
        "type": "state",
        "t": round(1000 * t_s, 3),
        "cup": [round(x, 5), round(z, 5), round(tilt, 4)],
        "ball": [round(float(ball.position_m[0]), 5), round(float(ball.position_m[2]), 5)],
        "pull": round(ball.tension_n, 3),
        "phase": table.phase,
        "outcome": table.outcome,
        "reason": table.reason,
        "steps": table.steps,
    }


def table(player: str, folder: Path, own: PlayTable, robots: GameSettings, settings: PlaySettings) -> dict[str, Any]:
    """Return the table of ``player``, the limits of its ease, and the folder of its tries."""
    ease, now = settings.ease, own.conditions
    return {
        "type": "table",
        "player": player,
        "folder": str(folder),
        "machine": f"the computer '{platform.node()}'",
        "ease": {
            "gravity": [ease.min_gravity_fraction, 1.0],
            "rope": list(ease.rope_scale),
            "cup": [1.0, ease.max_cup_scale],
        },
        "conditions": {"gravity": now.gravity_share, "rope": now.rope_scale, "cup": now.cup_scale},
        "game": _shapes(own.world.game),
        "robot": {"rope": robots.rope.length_m, "cup": robots.cup.radius_m},
        "delay_ms": 1000 * settings.smoothing_s,
    }


def tries(folder: TryFolder) -> dict[str, Any]:
    """Return all tries of a player, the oldest first."""
    kept = [
        {
            "name": one.name,
            "outcome": one.outcome,
            "chosen": one.chosen,
            "duration_s": one.duration_s,
            "conditions": one.conditions,
            "ease": one.conditions.partition(";")[0],
            "note": one.note,
        }
        for one in folder.tries()
    ]
    return {"type": "tries", "tries": kept}


def replay(name: str, samples: Array, robots: GameSettings) -> dict[str, Any]:
    """Return a stored try (n, columns) to be drawn again, in the robot's game as it was stored."""
    seen = samples[::SHOW_EVERY]
    tilt_rad = 2 * np.arctan2(seen[:, 6], seen[:, 4])
    columns = (seen[:, 1], seen[:, 3], tilt_rad, seen[:, 8], seen[:, 10])
    return {
        "type": "replay",
        "name": name,
        "speed": SLOW,
        "times": seen[:, 0].tolist(),
        "frames": np.column_stack(columns).round(4).tolist(),
        "game": _shapes(robots),
    }


def _shapes(game: GameSettings) -> dict[str, Any]:
    cup = game.cup
    return {
        "rope": game.rope.length_m,
        "ball": game.ball.radius_m,
        "cup": {"radius": cup.radius_m, "depth": cup.depth_m, "floor": cup.floor_m, "wall": cup.wall_m},
    }
