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
from kendama_cli.report.style import BALL, CUP, GOOD, INK, LINE, MUTED, OTHER, PAPER
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
    "What each rollout of the policy search cost: how far from the planned cup the ball came down, more where it never"
    " did; the rollouts of a generation are in one perturbed simulation. Bars: the fraction of the repeats after a"
    " generation, in fresh ones, that were caught; they stop once too many are lost, and do not count as rollouts."
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
    return Panel("The search for the motion's shape", made.svg)


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
    execution = [_tracking(log), _joint_speeds(log.table("/adapt/joints", JointStates)), repeats]
    return [
        *figure(
            lettered(
                search,
                [
                    "How far the ball crosses the rim plane from the cup's centre, over the time scale tau of the"
                    " movement primitive; one mark per simulated rollout. Shaded: the windows that were found;"
                    " bars: the centre of a window in perturbed simulations; dashed: the tau that"
                    " was chosen, with its perturbed repeats as dots; squares: rollouts in which the goal was moved"
                    " while the ball flew. Misses beyond the frame stand at its edge; crosses: the ball never rose"
                    " above the rim.",
                    CAPTION,
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
            axes.axvspan(window.low, window.high, color=GOOD, alpha=0.18, lw=0)
        axes.axhline(0, color=MUTED, lw=0.7)
        plain = same & ~moved
        for run in _unbroken(miss_mm[plain]):
            axes.plot(tau[plain][run], shown[plain][run], color=MUTED, lw=0.8, zorder=1)
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
                at = np.full(len(repeats), float(chosen))
                axes.plot(at, np.clip(1e3 * repeats["miss_m"], -edge, edge), ".", color=INK, ms=2.5, alpha=0.5)
        axes.set_ylim(-edge * 1.08, edge * 1.08)
        axes.set_xlabel("time scale tau")
        axes.set_ylabel("signed miss [mm]")
        legend_above(axes, columns=4)
    return Panel("The search for the time scale", made.svg)


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


def _tracking(log: StageLog) -> Panel | None:
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
        Panel("Perturbed repeats", made.svg),
        f"Repeats with rope, ball, air and arm sampled{sampled}, {caught_how}: {k} of {n} caught{interval}.",
    )


def replay(log: StageLog) -> list[Performance]:
    """Return the adapted swing, as the arm played it in simulation."""
    label = "Adapted swing, simulated"
    found = performance(log, "/adapt", label, "simulation", scene="/adapt/scene")
    return [found] if found is not None else []
