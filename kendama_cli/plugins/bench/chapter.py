"""The figure of bench: the return of each episode."""

from __future__ import annotations

import numpy as np

from kendama_cli.plugins.bench.messages import EpisodeMessage
from kendama_cli.report.figure import Figure, figure
from kendama_cli.report.plot import drawing
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import MUTED, SERIES

_MEDIAN = 21


def learning_figures(log: StageLog) -> list[Figure]:
    """Return the returns over the episodes."""
    table = log.table("/bench/episode", EpisodeMessage)
    if not len(table):
        return []
    greedy = table[~table["explored"].astype(bool)]
    exploring = table[table["explored"].astype(bool)]
    with drawing("bench-return", "Return of each episode") as made:
        (axes,) = made.axes()
        axes.plot(exploring["index"], exploring["total_reward"], ".", ms=3, color=MUTED, label="exploring")
        axes.plot(greedy["index"], greedy["total_reward"], ".", ms=4, color=SERIES[0], label="greedy")
        median = greedy["total_reward"].rolling(_MEDIAN, min_periods=1, center=True).median()
        axes.plot(greedy["index"], np.asarray(median), color=SERIES[1], label="running median")
        axes.set(xlabel="episode", ylabel="return")
        axes.legend()
    return figure(
        ["Return of each episode: exploring ones follow harmonics, greedy ones the table."],
        [made.panel("Return")],
        columns=1,
    )
