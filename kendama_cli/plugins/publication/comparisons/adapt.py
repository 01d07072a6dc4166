"""Adaptation over several runs: their searches, their swings and their repeats over each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kendama_cli.report.chapters import EnsembleChapter
from kendama_cli.report.ensemble import Ensemble, Group
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.grid import EMPTY, Cell, grid, percent, with_interval
from kendama_cli.report.intervals import mean_interval
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import MUTED, SERIES
from kendama_cli.report.tracks import Array, Geometry, Path2D, catch_time_s, pair
from kendama_cli.schema.declaration import Headline
from kendama_cli.stages.adapt.messages import AdaptRepeatMessage, AdaptRolloutMessage

_MOST_MISS_MM = 300.0
_BEFORE_S, _AFTER_S = 0.9, 0.12
"""Time before and after the catch of which a swing is drawn."""


def adaptation_comparison(runs: Ensemble) -> list[Figure]:
    """Draw misses over tau, the chosen swings, and the misses of the repeats."""
    panels = [_searches(runs.groups), _swings(runs.groups), _repeats(runs.groups)]
    return figure(
        lettered(
            panels,
            [
                "Signed distance between ball and cup centre at the rim plane over the time scale tau: a line for each"
                " run's search, dashed the chosen tau. A line that crosses zero slowly tolerates errors of tau. Larger"
                " misses stand at the edge.",
                "The chosen swing of each group's first run around the catch, in the swing plane, from the cup's start:"
                " the cup (thin) and the ball (thick).",
                "Fraction of perturbed repeats of all runs below a miss: a curve farther left is more precise. A ball"
                " that never came down counts as the largest miss.",
            ],
        ),
        panels,
    )


def adaptation_table(runs: Ensemble) -> str:
    """Return a table of tau, the search's rollouts and the fraction of repeats caught, for each group."""
    rows = []
    for group in runs.groups:
        tau, rollouts = group.figures("tau_scale"), group.figures("rollouts")
        rates, repeats = group.figures("success_rate"), [_repeated(member.log) for member in group.members]
        fraction = EMPTY
        if len(rates):
            planned = int(group.members[0].log.setting("adapt", "repeats", default=0))
            between = group.rate_between("success_rate", np.array([one for one in repeats if one]), planned)
            fraction = percent(float(rates.mean()), between=between, digits=1)
        cells = [
            with_interval(float(values.mean()), mean_interval(values)) if len(values) else EMPTY
            for values in (tau, rollouts)
        ]
        rows.append([group.cell(), Cell(str(len(group.members))), *cells, Cell(str(sum(repeats))), fraction])
    head = [runs.differs, "logs", "tau", "rollouts", "repeats", "caught"]
    note = "Below means their 95 % interval over the runs, below fractions the exact one over all repeats,"
    note += " or of the mean where evaluations ended early."
    return f'{grid(head, rows, name="adapt-compared", title="Time scale and catches")}<p class="note">{note}</p>'


def _searches(groups: Sequence[Group]) -> Panel | None:
    found = [[curve for member in group.members if len((curve := _search(member.log))[0]) > 1] for group in groups]
    if not any(found):
        return None
    with drawing("compare-search", "Miss over the time scale", height_in=3.4) as made:
        axes = made.axes()[0]
        axes.axhline(0, color=MUTED, lw=0.7, label="_no miss")
        for curves, group, colour in zip(found, groups, _colours(groups), strict=True):
            for number, (tau, miss_mm) in enumerate(curves):
                axes.plot(
                    tau, miss_mm, ".-", color=colour, lw=1.0, ms=3, label=f"_{group.legend}" if number else group.legend
                )
            for chosen in np.unique(group.figures("tau_scale")):
                axes.axvline(float(chosen), color=colour, lw=0.9, ls=(0, (4, 3)), label=f"_{group.legend}, chosen")
        axes.set_xlabel("time scale tau")
        axes.set_ylabel("signed miss [mm]")
        if len(groups) > 1:
            legend_above(axes, columns=min(3, len(groups)))
    return made.panel("The searches for the time scale")


def _search(log: StageLog) -> tuple[Array, Array]:
    """Return tau (n,) and signed miss (n,) [mm] of the rollouts of the chosen size, nothing moved, in tau's order."""
    rollouts = log.table("/adapt/rollout", AdaptRolloutMessage)
    if rollouts.empty:
        return np.empty(0), np.empty(0)
    still = (rollouts[["shift_x_m", "shift_y_m"]].to_numpy(np.float64) == 0.0).all(axis=1)
    same = rollouts["amplitude"].to_numpy(np.float64) == log.metrics.get("amplitude", 1.0)
    known = np.isfinite(rollouts["signed_miss_m"].to_numpy(np.float64))
    kept = rollouts[still & same & known].sort_values(["tau_scale", "index"])
    miss_mm = 1e3 * kept["signed_miss_m"].to_numpy(np.float64)
    return kept["tau_scale"].to_numpy(np.float64), np.clip(miss_mm, -_MOST_MISS_MM, _MOST_MISS_MM)


def _swings(groups: Sequence[Group]) -> Panel | None:
    found = [_swing(group.members[0].log) for group in groups]
    if not any(found):
        return None
    with drawing("compare-swing", "Paths of cup and ball in the swing plane", height_in=3.4) as made:
        axes = made.axes()[0]
        for paths, group, colour in zip(found, groups, _colours(groups), strict=True):
            if paths:
                cup, ball = paths
                axes.plot(cup.x_m, cup.z_m, color=colour, lw=0.9, label=f"_{group.legend}, cup")
                axes.plot(ball.x_m, ball.z_m, color=colour, lw=1.6, label=group.legend)
        axes.set_xlabel("x [m]")
        axes.set_ylabel("z [m]")
        axes.set_aspect("equal", adjustable="datalim")
        if len(groups) > 1:
            legend_above(axes, columns=min(3, len(groups)))
    return made.panel("The chosen swings")


def _swing(log: StageLog) -> tuple[Path2D, Path2D] | None:
    paths = pair(log, "/adapt")
    if paths is None:
        return None
    t_s = catch_time_s(*paths, Geometry.of(log).cup)
    cup, ball = paths
    return paths if t_s is None else (cup.between(t_s - _BEFORE_S, t_s + _AFTER_S), ball.between(t_s - _BEFORE_S, t_s))


def _repeats(groups: Sequence[Group]) -> Panel | None:
    found = [np.concatenate([_misses_mm(member.log) for member in group.members]) for group in groups]
    if max((len(misses) for misses in found), default=0) < 2:
        return None
    with drawing("compare-repeats", "Misses of the perturbed repeats", height_in=3.4) as made:
        axes = made.axes()[0]
        for misses, group, colour in zip(found, groups, _colours(groups), strict=True):
            fraction = (np.arange(len(misses)) + 1.0) / max(1, len(misses))
            axes.step(np.sort(misses), fraction, where="post", color=colour, lw=1.4, label=group.legend)
        axes.set_ylim(0, 1.02)
        axes.set_xlabel("miss [mm]")
        axes.set_ylabel("fraction of repeats")
        if len(groups) > 1:
            legend_above(axes, columns=min(3, len(groups)))
    return made.panel("Perturbed repeats")


def _misses_mm(log: StageLog) -> Array:
    repeats = log.table("/adapt/repeat", AdaptRepeatMessage)
    miss_mm = 1e3 * repeats["miss_m"].to_numpy(np.float64)
    return np.where(np.isfinite(miss_mm), np.minimum(np.abs(miss_mm), _MOST_MISS_MM), _MOST_MISS_MM)


def _repeated(log: StageLog) -> int:
    return len(log.table("/adapt/repeat", AdaptRepeatMessage))


def _colours(groups: Sequence[Group]) -> list[str]:
    return [SERIES[index % len(SERIES)] for index in range(len(groups))]


CHAPTER = EnsembleChapter(
    title="Adaptation",
    lead="The same search in several configurations.",
    topics=("/adapt/rollout", "/adapt/repeat", "/adapt/cup", "/adapt/ball"),
    figures=adaptation_comparison,
    tables=adaptation_table,
    headline=(Headline("success_rate", "of perturbed repeats caught by the adapted swing"),),
)
