"""Fractions of an arm's limits that a motion needs, as a table, a document, and words on the size that fits."""

from __future__ import annotations

import dataclasses
import math
import shlex
from typing import Any

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.cli import render
from kendama_cli.plugins.arms.smaller_game import SIZES, SmallerGame
from kendama_cli.robot_model.placement.find_placement import PlacedMotion
from kendama_cli.settings.game import GameSettings

TURNS_DEG = 3600.0
"""More than any arm turns between its stops."""
KINDS = ("position", "speed", "acceleration", "effort")


def rows_of(motion: PlacedMotion) -> list[dict[str, Any]]:
    """Return the fractions of each joint's limits as plain values, and its distance to the nearer stop."""
    shares = motion.shares
    columns = (shares.position, shares.velocity, shares.acceleration, shares.effort, shares.to_stop_rad)
    return [
        {"joint": name, **dict(zip(KINDS, map(float, fractions), strict=True)), "to_stop_deg": math.degrees(stop)}
        for name, *fractions, stop in zip(shares.joint_names, *columns, strict=True)
    ]


def document_of(motion: PlacedMotion) -> dict[str, Any]:
    """Return the motion's demand as plain values."""
    return {
        "placement": dataclasses.asdict(motion.placement),
        "joints": rows_of(motion),
        "leading": [dataclasses.asdict(one) for one in motion.shares.leading],
        "clearance": dataclasses.asdict(motion.clearance),
        "min_tau_scale": motion.min_tau_scale if math.isfinite(motion.min_tau_scale) else None,
        "tau_scale": motion.tau_scale,
        "fits": motion.workable,
    }


def show_motion(motion: PlacedMotion, adapt: AdaptSettings) -> None:
    """Show the table, the clearance, and from which tempo on the motion fits."""
    leading = {(one.kind, one.joint) for one in motion.shares.leading}
    rows = []
    for row in rows_of(motion):
        endless = row["to_stop_deg"] > TURNS_DEG  # a continuous joint has no stop
        shares = [f"{row[kind]:.2f}{' <' if (kind, row['joint']) in leading else ''}" for kind in KINDS]
        shares[0] = "-" if endless else shares[0]
        rows.append((row["joint"], *shares, "none" if endless else f"{row['to_stop_deg']:.0f} deg"))
    render.table(rows, head=("joint", *KINDS, "to stop"))
    clear = motion.clearance
    render.text(f"peaks over limits at tau_scale {motion.tau_scale:.2f}; < leads")
    render.text(f"clearance {1e3 * clear.gap_m:.0f} mm between {clear.parts} at {clear.t_s:.2f} s")
    render.prose(_tempo(motion.min_tau_scale, adapt))


def _tempo(tau: float, adapt: AdaptSettings) -> str:
    if math.isinf(tau):
        return "tempo: fits at none, however slow: the arm's own weight is beyond an effort limit"
    slowest = adapt.tau_range[1]
    told = f"tempo: fits from tau_scale {tau:.2f} on"
    beyond = f"; catches are searched up to {slowest:g} (adapt.tau_range), so that it can only be rehearsed"
    return told + (beyond if tau > slowest else "")


def size_words(found: SmallerGame | None, name: str) -> str:
    """Return in words at which size ``name`` can play, or that it can at none."""
    down = f"no size down to {SIZES[-1]:g}"
    if found is None:
        return f"{name} can play the game at {down}: it reaches none of the motions; choose another robot"
    if not found.motion.workable:
        most = found.motion.shares.leading[0]
        return f"{name} can play the game at {down}: {found.size:g} asks least, {most}; choose another robot"
    return f"a game {found.size:g} times as large fits, from tau_scale {found.motion.min_tau_scale:.2f} on"


def size_overrides(found: SmallerGame, game: GameSettings, adapt: AdaptSettings) -> list[str]:
    """Return what to type for the smaller game: its lengths and masses, and the motion's size and tempo."""
    tempo, size = math.sqrt(found.size), found.size * adapt.swing_scale
    low, high = (f"{tempo * one:.4g}" for one in adapt.tau_range)
    motion = [f"adapt.swing_scale={size:.4g}", f"adapt.tau_start={tempo * adapt.tau_start:.4g}"]
    return [*motion, f"adapt.tau_range=[{low},{high}]", *_changed(found.game, game, "game")]


def size_command(found: SmallerGame, game: GameSettings, adapt: AdaptSettings, overrides: list[str]) -> str:
    """Return the command that places the arm for the smaller game."""
    ours = ("adapt.swing_scale", "adapt.tau_start", "adapt.tau_range")
    kept = [one for one in overrides if not one.startswith(ours)]
    return shlex.join(["kendama", "robot", "place", *kept, *size_overrides(found, game, adapt)])


def _changed(new: Any, old: Any, key: str) -> list[str]:
    told = []
    for field in dataclasses.fields(old):
        one, other, path = getattr(new, field.name), getattr(old, field.name), f"{key}.{field.name}"
        if dataclasses.is_dataclass(other):
            told += _changed(one, other, path)
        elif one != other:
            told.append(f"{path}={one:.4g}")
    return told
