"""The figures of adapt: the search for the time scale, the catch, and how well it repeats."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import BALL, CUP, GOOD, INK, MUTED, OTHER, PAPER
from kendama_cli.report.tracks import Array, Geometry, Track, catch_time_s, pair, wilson

_MOST_MISS_MM = 300.0


def adaptation_figures(log: StageLog) -> list[Figure]:
    """The search and the catch; then tracking, joint speeds and the perturbed repeats."""
    search = [_search(log), _catch(log)]
    repeats, told = _repeats(log.table("/adapt/repeat"))
    execution = [_tracking(log), _joint_speeds(log.table("/adapt/joints")), repeats]
    return [
        *figure(
            lettered(
                search,
                [
                    "How far the ball crosses the rim plane from the cup's middle, over the time scale tau of the"
                    " movement primitive; one mark per simulated rollout. Shaded: where all neighbouring rollouts"
                    " caught; dashed: the tau that was chosen. Misses beyond the frame stand at its"
                    " edge; crosses: the ball never rose above the rim.",
                    "The chosen rollout in the swing plane, from 0.9 s before the catch to shortly after it: path of"
                    " the cup's tie point and of the ball, both every 60 ms, and the cup at the catch.",
                ],
            ),
            search,
        ),
        *figure(
            lettered(
                execution,
                [
                    "Distance between the commanded and the driven cup.",
                    "Joint velocities of the arm during the same rollout.",
                    told,
                ],
            ),
            execution,
            columns=3,
        ),
    ]


def draw_cup(axes: Axes, x_m: float, z_m: float, tilt_rad: float, sizes: Geometry) -> None:
    """The cup's outline with its tie point at (x, z)."""
    wide, deep = sizes.cup_radius_m, sizes.cup_depth_m
    outline = np.array([[-wide, deep], [-wide, 0.0], [wide, 0.0], [wide, deep]])
    c, s = np.cos(tilt_rad), np.sin(tilt_rad)
    turned = outline @ np.array([[c, -s], [s, c]])
    axes.plot(x_m + turned[:, 0], z_m + turned[:, 1], color=INK, lw=1.6, solid_joinstyle="round", zorder=4)


def swing_panel(name: str, title: str, paths: tuple[Track, Track], sizes: Geometry, at_s: float | None) -> Panel:
    """Cup and ball in the swing plane with a mark every 60 ms, and the cup's outline at ``at_s`` (else at the end)."""
    cup, ball = paths
    with drawing(name, f"{title}: path of cup and ball in the swing plane", height_in=3.6) as made:
        axes = made.axes()[0]
        for body, colour, label, size in ((cup, CUP, "cup (tie point)", 3.0), (ball, BALL, "ball", 4.2)):
            axes.plot(body.x_m, body.z_m, color=colour, lw=1.0, alpha=0.8)
            marks = body.at(np.arange(body.t_s[0], body.t_s[-1], 0.06))
            axes.plot(marks.x_m, marks.z_m, "o", color=colour, ms=size, mec=PAPER, mew=0.4, label=label)
        instant = cup.at(np.array([cup.t_s[-1] if at_s is None else at_s]))
        draw_cup(axes, instant.x_m[0], instant.z_m[0], instant.tilt_rad[0], sizes)
        axes.set_xlabel("x [m]")
        axes.set_ylabel("z [m]")
        axes.set_aspect("equal", adjustable="datalim")
        legend_above(axes)
    return Panel(title, made.svg)


def _search(log: StageLog) -> Panel | None:
    rollouts = log.table("/adapt/rollout")
    if rollouts.empty:
        return None
    rollouts = rollouts.sort_values(["tau_scale", "index"])
    miss_mm = 1e3 * rollouts["signed_miss_m"].to_numpy(np.float64)
    tau = rollouts["tau_scale"].to_numpy(np.float64)
    caught = rollouts["caught"].to_numpy(bool)
    known = np.isfinite(miss_mm)
    edge = min(_MOST_MISS_MM, 1.15 * float(np.abs(miss_mm[known]).max(initial=10.0)))
    shown = np.clip(np.where(known, miss_mm, -edge), -edge, edge)
    with drawing("adapt-search", "Miss over time scale", height_in=3.6) as made:
        axes = made.axes()[0]
        for start, end in _windows(tau, caught):
            axes.axvspan(start, end, color=GOOD, alpha=0.15, lw=0)
        axes.axhline(0, color=MUTED, lw=0.7)
        if not known.all():
            axes.plot(tau[~known], shown[~known], "x", color=MUTED, ms=4, label="too low")
        missed = known & ~caught
        axes.plot(tau[missed], shown[missed], "o", color=MUTED, ms=4.5, mfc=PAPER, label="missed")
        axes.plot(tau[caught], shown[caught], "o", color=GOOD, ms=5, label="caught")
        chosen = log.metrics.get("tau_scale")
        if isinstance(chosen, int | float):
            axes.axvline(chosen, color=INK, lw=0.9, ls=(0, (4, 3)), label=f"chosen, {chosen:.4g}")
        axes.set_ylim(-edge * 1.08, edge * 1.08)
        axes.set_xlabel("time scale tau")
        axes.set_ylabel("signed miss [mm]")
        legend_above(axes, columns=4)
    return Panel("The search for the time scale", made.svg)


def _windows(tau: Array, caught: np.ndarray) -> list[tuple[float, float]]:
    """Stretches of neighbouring rollouts that all caught, up to half way to the neighbours that missed."""
    windows = []
    edges = np.flatnonzero(np.diff(np.concatenate([[0], caught.astype(int), [0]])))
    for first, after in zip(edges[::2], edges[1::2], strict=True):
        start = tau[first] if first == 0 else (tau[first - 1] + tau[first]) / 2
        end = tau[after - 1] if after == len(tau) else (tau[after - 1] + tau[after]) / 2
        windows.append((float(start), float(end)))
    return windows


def _catch(log: StageLog) -> Panel | None:
    paths = pair(log, "/adapt")
    if paths is None:
        return None
    cup, ball = paths
    sizes = Geometry.of(log)
    t_s = catch_time_s(cup, ball, sizes.cup_depth_m)
    if t_s is not None:
        cup, ball = (body.between(t_s - 0.9, t_s + 0.12) for body in (cup, ball))
    return swing_panel("adapt-catch", "The catch" if t_s is not None else "The rollout", (cup, ball), sizes, t_s)


def _tracking(log: StageLog) -> Panel | None:
    wanted, driven = log.table("/adapt/reference"), log.table("/adapt/cup")
    if len(wanted) < 2 or len(driven) < 2:
        return None
    wanted = wanted.iloc[:: max(1, len(wanted) // 800)]
    t = wanted["t_s"].to_numpy(np.float64)
    error = [
        np.interp(t, driven["t_s"].to_numpy(np.float64), driven[axis].to_numpy(np.float64))
        - wanted[axis].to_numpy(np.float64)
        for axis in ("x_m", "y_m", "z_m")
    ]
    with drawing(
        "adapt-tracking", "Distance of the cup from its reference over time", width_in=3.4, height_in=2.6
    ) as made:
        axes = made.axes()[0]
        axes.plot(t, 1e3 * np.linalg.norm(error, axis=0), color=CUP, lw=1.2)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("distance [mm]")
        axes.set_ylim(bottom=0)
    return Panel("Following the reference", made.svg)


def _joint_speeds(joints: pd.DataFrame) -> Panel | None:
    columns = [name for name in joints.columns if str(name).endswith(".velocity_rad_s")]
    if not columns:
        return None
    joints = joints.iloc[:: max(1, len(joints) // 600)]
    shades = [CUP, BALL, GOOD, OTHER, MUTED, INK, "#e69f00", "#56b4e9"]
    with drawing("adapt-joints", "Joint velocities over time", width_in=3.4, height_in=2.6) as made:
        axes = made.axes()[0]
        for number, name in enumerate(columns):
            axes.plot(joints["t_s"], joints[name], color=shades[number % 8], lw=1.0, label=str(number + 1))
        axes.set_xlabel("time [s]")
        axes.set_ylabel("velocity [rad/s]")
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=8, handlelength=0.8, columnspacing=0.7)
    return Panel("Joint velocities", made.svg)


def _repeats(repeats: pd.DataFrame) -> tuple[Panel | None, str]:
    """The perturbed repeats sorted by miss, and the sentence that tells of them."""
    if repeats.empty:
        return None, ""
    repeats = repeats.sort_values(["miss_m", "index"], na_position="last").reset_index(drop=True)
    caught = repeats["caught"].to_numpy(bool)
    miss_mm = 1e3 * repeats["miss_m"].to_numpy(np.float64)
    shown = np.where(np.isfinite(miss_mm), np.clip(miss_mm, -_MOST_MISS_MM, _MOST_MISS_MM), _MOST_MISS_MM)
    rank = np.arange(1, len(shown) + 1)
    with drawing("adapt-repeats", "Miss of the perturbed repeats", width_in=3.4, height_in=2.6) as made:
        axes = made.axes()[0]
        axes.plot(rank[~caught], shown[~caught], "o", color=MUTED, mfc=PAPER, ms=4.5, label="missed")
        axes.plot(rank[caught], shown[caught], "o", color=GOOD, ms=4.5, label="caught")
        axes.set_xlabel("repeat, sorted")
        axes.set_ylabel("miss [mm]")
        legend_above(axes)
    n, k = len(caught), int(caught.sum())
    low, high = wilson(k, n)
    return (
        Panel("Perturbed repeats", made.svg),
        f"Repeats with a perturbed rope, ball and arm: {k} of {n} caught (95 % interval {low:.2f} to {high:.2f}).",
    )
