"""One motion that a replay can show: the bodies that a log moved, sampled evenly, and what was known of the catch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from kendama_cli.motion.rotation import between
from kendama_cli.motion.sampling import columns_at
from kendama_cli.physics.rim_crossing import near_descent, over_rim
from kendama_cli.report.replay.camera_images import CameraImages
from kendama_cli.report.tracks import cup_of, within
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import FrameTransform, FrameTransforms, SceneUpdate, Solid

if TYPE_CHECKING:  # a process that renders a film reads no log
    import pandas as pd

    from kendama_cli.report.source import StageLog

Kind = Literal["demonstration", "simulation", "robot", "referee"]

MOST_RATE_HZ = 100.0
MOST_SAMPLES = 3000


@dataclass(frozen=True)
class Frames:
    """Frames ``names`` (k,) in the world at ``start_s`` + i / ``rate_hz``: place [m] and wxyz, (n, k, 7)."""

    names: tuple[str, ...]
    start_s: float
    rate_hz: float
    poses: Array


@dataclass(frozen=True)
class Expected:
    """Prediction at ``t_s``: time, place (3,) and velocity (3,) of the ball's crossing of the rim's plane.

    ``covariance_m2`` (2, 2) is that of the place along x and y.
    """

    t_s: float
    crossing_s: float
    place_m: tuple[float, float, float]
    velocity_m_s: tuple[float, float, float]
    covariance_m2: Array


@dataclass(frozen=True)
class Performance:
    """A motion of cup and ball, and of the arm where its links were logged.

    ``catch_s`` is when the ball came down into the cup, by the same clock as the frames; None where it never did.
    ``placed`` is False for a motion that is known only relative to where it begins.
    """

    label: str
    kind: Kind
    bodies: Frames
    links: Frames | None = None
    solids: tuple[Solid, ...] = ()
    rope_m: float = 0.0
    rim_m: float = 0.0
    gravity_m_s2: float = 9.81
    catch_s: float | None = None
    expected: tuple[Expected, ...] = ()
    images: tuple[CameraImages, ...] = ()
    placed: bool = True

    def moved(self, by_m: Array) -> Performance:
        """Return the same elsewhere."""
        shift = np.concatenate([by_m, np.zeros(4)])
        return replace(self, bodies=replace(self.bodies, poses=self.bodies.poses + shift), placed=True)

    @property
    def start_m(self) -> Array:
        """Return where the cup begins (3,)."""
        return np.asarray(self.bodies.poses[0, self.bodies.names.index("cup"), :3])


def performance(
    log: StageLog,
    under: str,
    label: str,
    kind: Kind,
    *,
    scene: str | None = None,
    start_s: float = -math.inf,
    end_s: float = math.inf,
    expected: Sequence[Expected] = (),
    images: Sequence[CameraImages] = (),
) -> Performance | None:
    """Return what ``under``/cup, /ball and /links tell from ``start_s`` to ``end_s``; None where there is no ball and
    cup.

    ``scene`` is the topic that says what everything looks like.
    """
    paths = {name: within(log.table(f"{under}/{name}", FrameTransform), start_s, end_s) for name in ("cup", "ball")}
    if any(len(path) < 2 for path in paths.values()):
        return None
    poses = {name: (path["t_s"].to_numpy(np.float64), poses_of(path)) for name, path in paths.items()}
    bodies = _sampled(poses)
    links = _links(log, f"{under}/links", start_s, end_s)
    seen = log.messages(scene, SceneUpdate).messages if scene else ()
    rim_m = cup_of(log).rim_m
    return Performance(
        label,
        kind,
        bodies,
        links,
        seen[-1].solids if seen else (),
        rope_m=log.setting("rope", "length_m"),
        rim_m=rim_m,
        gravity_m_s2=log.setting("gravity_m_s2"),
        catch_s=came_down_s(bodies, rim_m),
        expected=tuple(expected),
        images=tuple(images),
    )


def carried(log: StageLog, label: str, kind: Kind, poses: dict[str, tuple[Array, Array]], rope_m: float) -> Performance:
    """Return a cup and a ball, their ``poses`` as times (n,) and poses (n, 7), where no arm was logged."""
    bodies, rim_m = _sampled(poses), cup_of(log).rim_m
    gravity_m_s2, catch_s = log.setting("gravity_m_s2"), came_down_s(bodies, rim_m)
    return Performance(label, kind, bodies, rope_m=rope_m, rim_m=rim_m, gravity_m_s2=gravity_m_s2, catch_s=catch_s)


def cup_alone(frame: pd.DataFrame, label: str) -> Performance | None:
    """Return a recorded path of the cup, which nobody says where in the room it was."""
    if len(frame) < 2:
        return None
    bodies = _sampled({"cup": (frame["t_s"].to_numpy(np.float64), poses_of(frame))})
    return Performance(label, "demonstration", bodies, placed=False)


def came_down_s(bodies: Frames, rim_m: float) -> float | None:
    """Time at which the ball came down through the rim's plane for the catch; None if it never did."""
    cup, ball = (bodies.poses[:, bodies.names.index(name)] for name in ("cup", "ball"))
    w, x, y, z = cup[:, 3:].T
    axis = 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)
    t_s = bodies.start_s + np.arange(len(cup)) / bodies.rate_hz
    found = near_descent(t_s, cup[:, :3], over_rim((ball[:, :3] - cup[:, :3]).T, axis, rim_m))
    return None if found is None else float(t_s[found])


def poses_of(frame: pd.DataFrame) -> Array:
    return frame[["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"]].to_numpy(np.float64)


def _links(log: StageLog, topic: str, start_s: float, end_s: float) -> Frames | None:
    logged = log.messages(topic, FrameTransforms)
    kept = [k for k, t_s in enumerate(logged.t_s.tolist()) if start_s < t_s <= end_s]
    if len(kept) < 2:
        return None
    names = tuple(logged.messages[kept[0]].children)
    rows = [
        np.hstack([np.array(one.positions_m), np.array(one.rotations_wxyz)])
        for one in (logged.messages[k] for k in kept)
        if tuple(one.children) == names
    ]
    t_s, poses = logged.t_s[kept], np.array(rows)
    return _sampled({name: (t_s, poses[:, k]) for k, name in enumerate(names)})


def _sampled(poses: dict[str, tuple[Array, Array]]) -> Frames:
    """Sample poses (n, 7) evenly: as often as the seldomest was logged, at most MOST_RATE_HZ."""
    start = max(float(t_s[0]) for t_s, _ in poses.values())
    end = min(float(t_s[-1]) for t_s, _ in poses.values())
    logged = min((len(t_s) - 1) / max(float(np.ptp(t_s)), 1e-6) for t_s, _ in poses.values())
    rate = min(MOST_RATE_HZ, logged, MOST_SAMPLES / max(end - start, 1e-3))
    t = start + np.arange(int((end - start) * rate + 1e-6) + 1) / rate
    return Frames(tuple(poses), start, rate, np.stack([poses_between(*one, t) for one in poses.values()], axis=1))


def poses_between(t_s: Array, poses: Array, t: Array) -> Array:
    """Interpolate poses at times ``t``: positions on straight lines, rotations by their normalised mean."""
    return np.hstack([columns_at(t, t_s, poses[:, :3]), between(t_s, poses[:, 3:], t)])
