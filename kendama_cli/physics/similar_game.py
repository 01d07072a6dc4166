"""Game of another size in which every motion is the same, only slower or faster."""

from __future__ import annotations

import dataclasses
from typing import Any

from kendama_cli.settings.game import GameSettings

POWERS = {
    "length_m": 1.0,
    "radius_m": 1.0,
    "depth_m": 1.0,
    "wall_m": 1.0,
    "below_rim_m": 1.0,
    "string_diameter_m": 1.0,
    "mass_kg": 3.0,
    "stiffness_n_m": 2.0,
    "damping_n_s_m": 2.5,
    "drag_n_s_m": 2.5,
    "linear_n_s_m": 2.5,
    "quadratic_n_s2_m2": 2.0,
}
"""Powers of the size with which the fields of a game grow; the others are numbers without a unit, angles, density."""


def similar_game(game: GameSettings, size: float) -> GameSettings:
    """Return ``game`` with lengths ``size`` times as long, of the same materials.

    Gravity g stays, so that times grow by sqrt(size) and accelerations stay (Froude's similarity: v^2 / (g l) is the
    same). Masses and so all forces grow by size^3; a force that grows with length, speed or speed squared has a
    coefficient that grows by size^2, size^2.5 or size^2.
    """
    made: GameSettings = _scaled(game, size)
    return made


def _scaled(part: Any, size: float) -> Any:
    """Return a dataclass with its fields of POWERS, and those of dataclasses in it, scaled."""
    changed: dict[str, Any] = {}
    for field in dataclasses.fields(part):
        value = getattr(part, field.name)
        if dataclasses.is_dataclass(value):
            changed[field.name] = _scaled(value, size)
        elif field.name in POWERS:
            changed[field.name] = value * size ** POWERS[field.name]
    return dataclasses.replace(part, **changed)
