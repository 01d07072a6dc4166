"""Figures of adapt: the search for the time scale, the catch, and how well it repeats."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from kendama_cli.report.animation import player
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.replay.performance import Performance, performance
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import BALL, CUP, GOOD, INK, LINE, MUTED, OTHER, PAPER, SERIES
from kendama_cli.report.swing_up_panels import swing_panel
from kendama_cli.report.tracks import Array, Geometry, catch_time_s, pair
from kendama_cli.schema.foxglove import FrameTransform, JointStates
from kendama_cli.stages.adapt.messages import (
    AdaptEvaluationMessage,
    AdaptExploredMessage,
    AdaptRepeatMessage,
    AdaptRolloutMessage,
    AdaptWindowMessage,
)

_MAX_COST_MM = 500.0
CAPTION = (
    "Cost of each rollout of the policy search: distance between ball and planned cup, more if the ball stayed low; it"
    " must fall. The rollouts of a generation share one perturbed simulation. Bars: fraction of repeats after a"
    " generation, in fresh simulations, that were caught; they stop once too many are lost and are not rollouts."
)


def policy_search(log: StageLog) -> Panel | None:
    """Draw costs and outcomes over the rollouts; None if the search was another."""
    explored = log.table("/adapt/explored", AdaptExploredMessage)
    if explored.empty:
        return None
    number = explored["index"].to_numpy(np.float64) + 1.0
    cost_mm = np.minimum(1e3 * explored["cost_m"].to_numpy(np.float64), _MAX_COST_MM)
    caught = explored["caught"].to_numpy(bool)
    with drawing("adapt-policy", "Cost of the rollouts of the policy search", height_in=3.6) as made:
        axes = made.axes()[0]
        for which, fill, colour, label in ((~caught, PAPER, MUTED, "missed"), (caught, GOOD, GOOD, "caught")):
            if which.any():
                axes.plot(number[which], cost_mm[which], "o", color=colour, mfc=fill, ms=4.5, label=label)
        axes.set_xlabel("rollout")
        axes.set_ylabel("cost [mm]")
        axes.set_ylim(bottom=0)
        proofs = log.table("/adapt/evaluation", AdaptEvaluationMessage)
        if len(proofs):
            right = axes.twinx()
            fractions = proofs.groupby("rollouts")["caught"].mean()
            after = fractions.index.to_numpy(np.float64) + 0.5
            right.bar(
                after, 100 * fractions.to_numpy(np.float64), width=0.5, color=BALL, alpha=0.5, label="repeats caught"
            )
            right.set_ylim(0, 105)
            right.set_ylabel("repeats caught [%]", color=INK)
            right.grid(visible=False)
        legend_above(axes)
    return made.panel("The search for the motion's shape")


_MOST_MISS_MM = 300.0
_JUMP_MM = 500.0
_CATCH = {"visual": "the cup moved to where the flying ball was seen to come down", "open_loop": "played as planned"}


def film(log: StageLog) -> str | None:
    """Return the adapted swing from start to catch, for the head of the page."""
    paths = pair(log, "/adapt")
    if paths is None:
        return None
    sizes = Geometry.of(log)
    caught_s = catch_time_s(*paths, sizes.cup)
    shown = player("catch", *paths, sizes, poster_s=None if caught_s is None else caught_s - 0.12, autoplay=True)
    return shown + "<p class=run style='margin:8px 0 0'>The adapted swing, played by the arm in simulation.</p>"


def adaptation_figures(log: StageLog) -> list[Figure]:
    """Return figures of the search and the catch, then of tracking, joint speeds and the perturbed repeats."""
    search = [_search(log), policy_search(log), _catch(log)]
    repeats, caption = _repeats(log)
    catch_s = _catch_s(log)
    execution = [_tracking(log, catch_s), _joint_speeds(log.table("/adapt/joints", JointStates), catch_s), repeats]
    visual = log.metrics.get("catch") == "visual"
    moved = " Visual feedback then moves the cup off its plan to the ball, so the distance grows." if visual else ""
    return [
        *figure(
            lettered(
                search,
                [
                    "Signed distance between ball and cup centre when the ball crosses the rim plane, over the time"
                    " scale tau; each mark is a simulated rollout. Where the line crosses zero, the ball is caught:"
                    " shaded windows of tau. Dashes: the centre of a window in perturbed simulations. Dashed line: the"
                    " chosen tau, its perturbed repeats as dots. Squares: the goal was moved in flight. Crosses: the"
                    " ball stayed below the rim. Larger misses stand at the edge.",
                    CAPTION,
                    "The chosen rollout in the swing plane, from 0.9 s before the catch: the ball swings up, the rope"
                    " goes slack, and the ball falls into the cup. Marks every 60 ms; the cup is drawn at the catch.",
                ],
            ),
            search,
        ),
        *figure(
            lettered(
                execution,
                [
                    "Distance of the cup from the planned swing: while the rope is taut it must be small, so that the"
                    f" ball flies as planned.{moved}",
                    "Joint velocities of the arm in the chosen rollout, by joint: where a curve is steep, that joint"
                    " needs torque.",
                    caption,
                ],
            ),
            execution,
            columns=3,
        ),
    ]


def _search(log: StageLog) -> Panel | None:
    rollouts = log.table("/adapt/rollout", AdaptRolloutMessage)
    if rollouts.empty:
        return None
    rollouts = rollouts.sort_values(["tau_scale", "index"])
    moved = (rollouts[["shift_x_m", "shift_y_m"]].to_numpy(np.float64) != 0.0).any(axis=1)
    same = rollouts["amplitude"].to_numpy(np.float64) == log.metrics.get("amplitude", 1.0)
    tau = rollouts["tau_scale"].to_numpy(np.float64)
    miss_mm = 1e3 * rollouts["signed_miss_m"].to_numpy(np.float64)
    caught = rollouts["caught"].to_numpy(bool)
    known = np.isfinite(miss_mm)
    edge = min(_MOST_MISS_MM, 1.15 * float(np.abs(miss_mm[known]).max(initial=10.0)))
    shown = np.clip(np.where(known, miss_mm, -edge), -edge, edge)
    judged = log.table("/adapt/candidate", AdaptRolloutMessage)
    repeats = log.table("/adapt/repeat", AdaptRepeatMessage)
    windows = log.messages("/adapt/window", AdaptWindowMessage)
    with drawing("adapt-search", "Miss over time scale", height_in=3.6) as made:
        axes = made.axes()[0]
        for window in windows.messages:
            label = "window" if window is windows.messages[0] else ""
            axes.axvspan(window.low, window.high, color=GOOD, alpha=0.18, lw=0, label=label)
        axes.axhline(0, color=MUTED, lw=0.7, label="_no miss")
        plain = same & ~moved
        for run in _unbroken(miss_mm[plain]):
            axes.plot(tau[plain][run], shown[plain][run], color=MUTED, lw=0.8, zorder=1, label="_neighbours")
        marks: tuple[tuple[Any, dict[str, Any]], ...] = (
            (plain & ~known, {"marker": "x", "color": MUTED, "ms": 4, "label": "too low"}),
            (known & plain & ~caught, {"marker": "o", "color": MUTED, "ms": 4.5, "mfc": PAPER, "label": "missed"}),
            (known & plain & caught, {"marker": "o", "color": GOOD, "ms": 5, "label": "caught"}),
            (known & moved & same, {"marker": "s", "color": OTHER, "ms": 4.5, "mfc": PAPER, "label": "goal moved"}),
            (known & ~same, {"marker": ".", "color": LINE, "ms": 5, "label": "other size"}),
        )
        for which, look in marks:
            if which.any():
                axes.plot(tau[which], shown[which], ls="none", **look)
        if len(judged):
            axes.plot(
                judged["tau_scale"],
                np.clip(1e3 * judged["signed_miss_m"], -edge, edge),
                "_",
                color=BALL,
                ms=9,
                label="perturbed simulations",
            )
        chosen = log.metrics.get("tau_scale")
        if isinstance(chosen, int | float):
            axes.axvline(chosen, color=INK, lw=0.9, ls=(0, (4, 3)), label=f"chosen, {chosen:.4g}")
            if len(repeats):
                at, repeated = np.full(len(repeats), float(chosen)), np.clip(1e3 * repeats["miss_m"], -edge, edge)
                axes.plot(at, repeated, ".", color=INK, ms=2.5, alpha=0.5, label="_repeats")
        axes.set_ylim(-edge * 1.08, edge * 1.08)
        axes.set_xlabel("time scale tau")
        axes.set_ylabel("signed miss [mm]")
        legend_above(axes, columns=4)
    return made.panel("The search for the time scale")


def _unbroken(miss_mm: Array) -> list[slice]:
    """Return stretches of neighbouring rollouts whose ball fell in the same way: no gap or jump of the miss."""
    joined = np.abs(np.diff(miss_mm)) < _JUMP_MM
    ends = np.flatnonzero(~joined) + 1
    return [slice(a, b) for a, b in zip([0, *ends.tolist()], [*ends.tolist(), len(miss_mm)], strict=True) if b - a > 1]


def _catch(log: StageLog) -> Panel | None:
    paths = pair(log, "/adapt")
    if paths is None:
        return None
    cup, ball = paths
    sizes = Geometry.of(log)
    t_s = catch_time_s(cup, ball, sizes.cup)
    if t_s is not None:
        cup, ball = (body.between(t_s - 0.9, t_s + 0.12) for body in (cup, ball))
    return swing_panel("adapt-catch", "The catch" if t_s is not None else "The rollout", (cup, ball), sizes, t_s)


def _catch_s(log: StageLog) -> float | None:
    """Return the time of the catch by the log's clock; None where there is none."""
    paths = pair(log, "/adapt")
    return None if paths is None else catch_time_s(*paths, Geometry.of(log).cup)


def _time_label(catch_s: float | None) -> str:
    return "time [s]" if catch_s is None else "time from the catch [s]"


def _tracking(log: StageLog, catch_s: float | None) -> Panel | None:
    reference, driven = log.table("/adapt/reference", FrameTransform), log.table("/adapt/cup", FrameTransform)
    if len(reference) < 2 or len(driven) < 2:
        return None
    reference = reference.iloc[:: max(1, len(reference) // 800)]
    t = reference["t_s"].to_numpy(np.float64)
    error = [
        np.interp(t, driven["t_s"].to_numpy(np.float64), driven[axis].to_numpy(np.float64))
        - reference[axis].to_numpy(np.float64)
        for axis in ("x_m", "y_m", "z_m")
    ]
    with drawing(
        "adapt-tracking", "Distance of the cup from its reference over time", width_in=3.4, height_in=2.6
    ) as made:
        axes = made.axes()[0]
        distance_mm = 1e3 * np.linalg.norm(error, axis=0)
        axes.plot(t - (catch_s or 0.0), distance_mm, color=CUP, lw=1.2, label="cup to its reference")
        axes.set_xlabel(_time_label(catch_s))
        axes.set_ylabel("distance [mm]")
        axes.set_ylim(bottom=0)
    return made.panel("Following the reference")


def _joint_speeds(joints: pd.DataFrame, catch_s: float | None) -> Panel | None:
    columns = [name for name in joints.columns if str(name).endswith(".velocity_rad_s")]
    if not columns:
        return None
    joints = joints.iloc[:: max(1, len(joints) // 600)]
    t = joints["t_s"].to_numpy(np.float64) - (catch_s or 0.0)
    with drawing("adapt-joints", "Joint velocities over time", width_in=3.4, height_in=2.6) as made:
        axes = made.axes()[0]
        for number, name in enumerate(columns):
            label = str(name).removesuffix(".velocity_rad_s")
            axes.plot(t, joints[name], color=SERIES[number % len(SERIES)], lw=1.0, label=label)
        axes.set_xlabel(_time_label(catch_s))
        axes.set_ylabel("velocity [rad/s]")
        legend_above(axes, columns=8)
    return made.panel("Joint velocities")


def _repeats(log: StageLog) -> tuple[Panel | None, str]:
    """Return the perturbed repeats sorted by miss, and the sentence about them."""
    repeats = log.table("/adapt/repeat", AdaptRepeatMessage)
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
    preset = log.metrics.get("uncertainty")
    # a stage that still runs says it at its end
    sampled = "" if preset is None else f" from the uncertainty '{preset}'"
    caught_how = _CATCH.get(str(log.metrics.get("catch")), "played")
    low, high = (log.metrics.get(f"success_rate_{end}") for end in ("low", "high"))
    interval = "" if low is None or high is None else f" (95 % interval {low:.3f} to {high:.3f})"
    return (
        made.panel("Perturbed repeats"),
        f"Repeats with rope, ball, air and arm sampled{sampled}, {caught_how}: {k} of {n} caught{interval}.",
    )


def replay(log: StageLog) -> list[Performance]:
    """Return the adapted swing, as the arm played it in simulation."""
    label = "Adapted swing, simulated"
    found = performance(log, "/adapt", label, "simulation", scene="/adapt/scene")
    return [found] if found is not None else []
