"""Paths of cup and ball as arrays in the swing plane, and the few numbers that captions give."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes

from kendama_cli.log.reader import logged_settings
from kendama_cli.physics.rim_crossing import near_descent, over_rim
from kendama_cli.report.source import StageLog
from kendama_cli.schema.foxglove import FrameTransform
from kendama_cli.settings.game import CupSettings

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Path2D:
    """A path in the swing plane: ``t_s``, ``x_m``, ``z_m`` (n,) and the tilt of the body's axis to x (n,) [rad]."""

    t_s: Array
    x_m: Array
    z_m: Array
    tilt_rad: Array

    def between(self, start_s: float, end_s: float) -> Path2D:
        """Return the part from ``start_s`` to ``end_s``."""
        keep = (self.t_s >= start_s) & (self.t_s <= end_s)
        return Path2D(self.t_s[keep], self.x_m[keep], self.z_m[keep], self.tilt_rad[keep])

    def at(self, t_s: Array) -> Path2D:
        """Return the path at other times, by linear interpolation."""
        x, z, tilt = (np.interp(t_s, self.t_s, values) for values in (self.x_m, self.z_m, self.tilt_rad))
        return Path2D(t_s, x, z, tilt)

    def moved(self, x_m: float, z_m: float) -> Path2D:
        """Return the path shifted."""
        return Path2D(self.t_s, self.x_m + x_m, self.z_m + z_m, self.tilt_rad)


@dataclass(frozen=True)
class Geometry:
    """The game's sizes [m], the cup's among them, and gravity, from the settings in the log."""

    rope_m: float
    ball_m: float
    cup: CupSettings
    gravity_m_s2: float

    @staticmethod
    def of(log: StageLog) -> Geometry:
        """Return what the stage was run with; raises InputError where the log's settings do not have it."""
        return Geometry(
            rope_m=log.setting("rope", "length_m"),
            ball_m=log.setting("ball", "radius_m"),
            cup=cup_of(log),
            gravity_m_s2=log.setting("gravity_m_s2"),
        )


def direction(frame: pd.DataFrame) -> tuple[float, float]:
    """Return the horizontal unit vector (x, y) along which a path extends most; exactly x where it is within 3
    degrees.
    """
    points = frame[["x_m", "y_m"]].to_numpy(np.float64)
    spread = np.cov((points - points.mean(axis=0)).T)
    _, vectors = np.linalg.eigh(spread)
    x, y = vectors[:, -1] * (-1.0 if vectors[0, -1] < 0 else 1.0)
    return (1.0, 0.0) if abs(y) < 0.05 or not spread.any() else (float(x), float(y))


def track(frame: pd.DataFrame, along: tuple[float, float] = (1.0, 0.0)) -> Path2D:
    """Return a FrameTransform table as a path in the plane of ``along`` and z, at most 1500 points of it."""
    frame = frame.iloc[:: max(1, len(frame) // 1500)]
    x, y = along
    w, qx, qy, qz = (frame[name].to_numpy(np.float64) for name in ("qw", "qx", "qy", "qz"))
    axis_x, axis_y, axis_z = 2 * (qx * qz + w * qy), 2 * (qy * qz - w * qx), 1 - 2 * (qx**2 + qy**2)
    return Path2D(
        t_s=frame["t_s"].to_numpy(np.float64),
        x_m=x * frame["x_m"].to_numpy(np.float64) + y * frame["y_m"].to_numpy(np.float64),
        z_m=frame["z_m"].to_numpy(np.float64),
        tilt_rad=np.arctan2(x * axis_x + y * axis_y, axis_z),
    )


def pair(
    log: StageLog, prefix: str, start_s: float = -math.inf, end_s: float = math.inf
) -> tuple[Path2D, Path2D] | None:
    """Return the paths of ``prefix``/cup and ``prefix``/ball after ``start_s`` up to ``end_s``, in one plane.

    Positions are relative to where the cup begins. None where there are no paths.
    """
    cup, ball = (within(log.table(f"{prefix}/{body}", FrameTransform), start_s, end_s) for body in ("cup", "ball"))
    if len(cup) < 2 or len(ball) < 2:
        return None
    along = direction(ball)
    cup_track, ball_track = track(cup, along), track(ball, along)
    x0, z0 = cup_track.x_m[0], cup_track.z_m[0]
    return cup_track.moved(-x0, -z0), ball_track.moved(-x0, -z0)


def within(frame: pd.DataFrame, start_s: float, end_s: float) -> pd.DataFrame:
    """Return the rows of ``frame`` after ``start_s``, up to ``end_s``."""
    return frame[(frame["t_s"] > start_s) & (frame["t_s"] <= end_s)] if len(frame) else frame


def last_start_s(frame: pd.DataFrame) -> float:
    """Return the time before the last stretch of a path: several attempts in one topic are parted by a jump."""
    if len(frame) < 2:
        return -math.inf
    jump = np.linalg.norm(np.diff(frame[["x_m", "y_m", "z_m"]].to_numpy(np.float64), axis=0), axis=1)
    parted = np.flatnonzero((jump > 0.15) | (np.diff(frame["t_s"].to_numpy(np.float64)) > 0.25))
    return float(frame["t_s"].iloc[parted[-1]]) if len(parted) else -math.inf


def cup_of(log: StageLog) -> CupSettings:
    """Return the cup of the stage's game; raises InputError where the log does not have it."""
    return logged_settings(CupSettings, log.group("cup"), "game.cup", log.path)


def cup_outline_m(cup: CupSettings) -> Array:
    """Return the outline (k, 2) of a cup in its own plane, x and height over its place, with its handle."""
    wide, floor, rim = cup.radius_m, cup.floor_m, cup.rim_m
    handle = [(0.0, floor), (0.0, 0.0), (0.0, floor)] if floor else []
    return np.array([(-wide, rim), (-wide, floor), *handle, (wide, floor), (wide, rim)])


def catch_time_s(cup: Path2D, ball: Path2D, of: CupSettings) -> float | None:
    """Return when the ball comes down through the rim's plane for the catch; None if it never does."""
    held = cup.at(ball.t_s)
    axis = np.sin(held.tilt_rad), 0.0 * held.tilt_rad, np.cos(held.tilt_rad)
    apart = ball.x_m - held.x_m, 0.0 * held.x_m, ball.z_m - held.z_m
    found = near_descent(ball.t_s, np.column_stack([held.x_m, held.z_m]), over_rim(apart, axis, of.rim_m))
    return None if found is None else float(ball.t_s[found])


def running_median(values: Array, half_width: int) -> Array:
    """Return the median over a centred window that shrinks at the ends."""
    n = len(values)
    return np.array([np.median(values[max(0, i - half_width) : min(n, i + half_width + 1)]) for i in range(n)])


def paths_by_child(frame: pd.DataFrame, along: tuple[float, float] | None = None) -> list[Path2D]:
    """Return one path per child frame, each relative to its own start, all in one plane."""
    if len(frame) < 3:
        return []
    plane = direction(frame) if along is None else along
    tracks = [track(part, plane) for _, part in frame.groupby("child", sort=True) if len(part) > 1]
    return [one.moved(-one.x_m[0], -one.z_m[0]) for one in tracks]


def side_view(axes: Axes) -> None:
    """Label axes that show a path in the swing plane, one metre as long as another."""
    axes.set_xlabel("x [m]")
    axes.set_ylabel("z [m]")
    axes.set_aspect("equal", adjustable="datalim")
