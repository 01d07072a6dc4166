"""Prediction over several runs: their errors over each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from kendama_cli.report.chapters import EnsembleChapter
from kendama_cli.report.ensemble import Ensemble, Group
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.grid import EMPTY, Cell, grid, with_interval
from kendama_cli.report.intervals import mean_interval
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.style import SERIES
from kendama_cli.schema.declaration import Headline
from kendama_cli.stages.predict.chapter import like_horizons
from kendama_cli.stages.predict.messages import PredictionErrorMessage

_TOLD = ("position_error_mm_p50", "position_error_mm_p95", "time_error_ms_p50", "time_error_ms_p95")


def prediction_comparison(runs: Ensemble) -> list[Figure]:
    """Return the errors of position and time over the remaining time, a line for each group."""
    pooled = [_errors(group) for group in runs.groups]
    panels = [
        _panel(runs.groups, pooled, "position_error_mm", "Position of the catch"),
        _panel(runs.groups, pooled, "time_error_ms", "Time of the catch"),
    ]
    told = "error of the predicted catch over the remaining time, the flights of all runs: median, and 90 % of them"
    captions = [f"{what} {told} (shaded). It must fall to the right." for what in ("Position", "Time")]
    return figure(lettered(panels, captions), panels)


def prediction_table(runs: Ensemble) -> str:
    """Return the errors' quantiles, for each group."""
    rows = []
    for group in runs.groups:
        found = [group.figures(name) for name in _TOLD]
        cells = [
            with_interval(float(values.mean()), mean_interval(values)) if len(values) else EMPTY for values in found
        ]
        rows.append([group.cell(), Cell(str(len(group.members))), *cells])
    head = [runs.differs, "logs", "position, 50 % [mm]", "position, 95 % [mm]", "time, 50 % [ms]", "time, 95 % [ms]"]
    note = "Means over the runs; below them their 95 % interval."
    table = grid(head, rows, name="predict-errors", title="Errors of the predicted catch")
    return f'{table}<p class="note">{note}</p>'


def _errors(group: Group) -> pd.DataFrame:
    found = [member.log.table("/predict/error", PredictionErrorMessage) for member in group.members]
    errors = pd.concat(found, ignore_index=True)
    return errors.assign(horizon_ms=like_horizons(errors["horizon_ms"]))


def _panel(groups: Sequence[Group], pooled: Sequence[pd.DataFrame], column: str, title: str) -> Panel | None:
    known = [errors[np.isfinite(errors[column].to_numpy(np.float64))] for errors in pooled]
    if all(errors["horizon_ms"].nunique() < 2 for errors in known):
        return None
    unit = column.rsplit("_", 1)[1]
    with drawing(f"compare-{unit}", f"{title}: error against the horizon", height_in=3.2) as made:
        axes = made.axes()[0]
        for index, (errors, group) in enumerate(zip(known, groups, strict=True)):
            if errors.empty:
                continue
            colour = SERIES[index % len(SERIES)]
            spread = errors[column].abs().groupby(errors["horizon_ms"]).quantile(np.array([0.05, 0.5, 0.95])).unstack()
            at = spread.index.to_numpy(np.float64)
            axes.fill_between(
                at, spread[0.05], spread[0.95], color=colour, alpha=0.14, lw=0, label=f"_{group.legend}, 90 %"
            )
            axes.plot(at, spread[0.5], ".-", color=colour, ms=3.5, lw=1.3, label=group.legend)
        axes.invert_xaxis()
        axes.set_ylim(bottom=0)
        axes.set_xlabel("time to the catch [ms]")
        axes.set_ylabel(f"error [{unit}]")
        if len(groups) > 1:
            legend_above(axes, columns=min(3, len(groups)))
    return made.panel(title)


CHAPTER = EnsembleChapter(
    title="Catch prediction",
    lead="The same flights, or others, as several configurations saw them.",
    topics=("/predict/error",),
    figures=prediction_comparison,
    tables=prediction_table,
    headline=(Headline("position_error_mm_p50", "median error of the predicted catch, mm"),),
)
