"""The tables of learning over several seeds: rollouts to solved, their ratios, and the frozen policies."""

from __future__ import annotations

import dataclasses
import html

import numpy as np

from kendama_cli.report.ensemble import Ensemble, Group
from kendama_cli.report.grid import EMPTY, Cell, grid, percent, quantity, with_interval
from kendama_cli.report.intervals import (
    improvement,
    interquartile_interval,
    interquartile_mean,
    mean_interval,
    quantile_interval,
    rate_interval,
    ratio_interval,
)
from kendama_cli.report.tracks import Array


def learning_tables(runs: Ensemble) -> str:
    """Return the figures by group with intervals, what they gain on the first group, and the unsolved by seed."""
    groups = [group for group in runs.groups if len(group.figures("rollouts_to_solved"))]
    if not groups:
        return ""
    head = [runs.differs or "", "seeds", "unsolved", *(f"to solved, {name}" for name in _FIGURES)]
    head += ["to ten in a row, median", "random"]
    parts = [grid(head, [_counts(group) for group in groups], name="learn-solved", title="Rollouts to solved")]
    unsolved = [sentence for group in groups if (sentence := _unsolved(group, runs.differs))]
    parts.append(f'<p class="note">{" ".join(unsolved) or "Every seed is solved."} {_RULE}</p>')
    if len(groups) > 1:
        reference, *others = groups
        names = [runs.differs, "solved sooner", "ratio of means", "difference"]
        rows = [_compared(group, reference) for group in others]
        title = f"Against {reference.label}"
        parts.append(grid(names, rows, name="learn-ratios", title=title))
    head = [
        runs.differs or "",
        "caught by noisy sight",
        "worst seed",
        "caught, true ball known",
        "half-swings",
        "time to release",
    ]
    head.append("peak displacement")
    parts.append(grid(head, [_quality(group) for group in groups], name="learn-frozen", title="The frozen policies"))
    return "".join(parts)


_FIGURES = ("median", "interquartile mean", "mean", "90 %")
_RULE = (
    "Counted up to the first of the greedy successes in a row that count as solved, exploring rollouts included. An"
    " unsolved seed counts as the cap, and a mean with such seeds is a restricted mean. Random: fraction of random"
    " harmonics that succeed. Solved sooner: of all pairs of seeds, one of each, the fraction in which the row needs"
    " fewer rollouts; it is noise if its interval holds 50 %. Below each figure its 95 % interval over the seeds, where"
    " there are enough."
)


def _counts(group: Group) -> list[Cell]:
    values, first = group.figures("rollouts_to_solved"), group.figures("rollouts_to_learned")
    chance = group.figures("random_success_rate")
    mean = with_interval(float(values.mean()), mean_interval(values))
    cells = [
        with_interval(float(np.median(values)), quantile_interval(values)),
        with_interval(float(interquartile_mean(values)), interquartile_interval(values)),
        dataclasses.replace(mean, text=f"{mean.text} (restricted)") if _failed(group) else mean,
        with_interval(float(np.quantile(values, 0.9)), quantile_interval(values, 0.9)),
        with_interval(float(np.median(first)), quantile_interval(first)) if len(first) else EMPTY,
        percent(float(chance.mean())) if len(chance) else EMPTY,
    ]
    return [group.cell(), Cell(str(len(values))), Cell(str(len(_failed(group)))), *cells]


def _compared(group: Group, reference: Group) -> list[Cell]:
    values, others = group.figures("rollouts_to_solved"), reference.figures("rollouts_to_solved")
    sooner, between = improvement(values, others)
    ratio = with_interval(float(values.mean() / others.mean()), ratio_interval(values, others))
    stands = not between[0] <= 0.5 <= between[1]
    return [group.cell(), percent(sooner, between=between), ratio, Cell("stands" if stands else "noise")]


def _failed(group: Group) -> list[str]:
    return [member.seed for member in group.members if member.log.metrics.get("solved") is False]


def _unsolved(group: Group, differs: str) -> str:
    failed = _failed(group)
    if not failed:
        return ""
    of = f" ({html.escape(group.label)})" if differs else ""
    return f"Unsolved{of}: seed {', '.join(html.escape(seed or 'as configured') for seed in failed)}."


def _quality(group: Group) -> list[Cell]:
    caught, known = group.figures("frozen_visual_caught_rate"), group.figures("frozen_caught_rate")
    rates = ((member.figure("frozen_visual_caught_rate"), member.seed) for member in group.members)
    worst = min(((rate, seed) for rate, seed in rates if rate is not None), default=None)
    peak = group.figures("peak_displacement_m")
    medians = {name: _median(group.figures(name)) for name in ("half_swings", "time_to_goal_s")}
    return [
        group.cell(),
        percent(float(caught.mean()), between=rate_interval(caught), digits=1) if len(caught) else EMPTY,
        EMPTY if worst is None else percent(worst[0], f"seed {worst[1]}" if worst[1] else ""),
        percent(float(known.mean()), between=rate_interval(known), digits=1) if len(known) else EMPTY,
        _cell(medians["half_swings"]),
        _cell(medians["time_to_goal_s"], "s"),
        _cell(float(peak.max()) if len(peak) else None, "m"),
    ]


def _cell(value: float | None, unit: str = "") -> Cell:
    return Cell(quantity(value, unit=unit), values={f"[{unit}]" if unit else "": value})


def _median(values: Array) -> float | None:
    return float(np.median(values)) if len(values) else None
