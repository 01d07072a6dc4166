"""Learning over many seeds: reward, rollouts to solved with intervals, and what the frozen policies do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator, MultipleLocator, PercentFormatter

from kendama_cli.log.messages import RolloutMessage
from kendama_cli.plugins.publication.comparisons.learn_tables import learning_tables
from kendama_cli.report.chapters import EnsembleChapter
from kendama_cli.report.ensemble import Ensemble, Group
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.intervals import interquartile_interval, interquartile_mean
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import SERIES
from kendama_cli.report.tracks import Array
from kendama_cli.schema.declaration import Headline

_TAIL = 10
"""A run that has ended is carried on with the median reward of its last greedy rollouts."""
_LONG = 100
"""Beyond so many rollouts the axis is logarithmic, and every curve a mean over steps that are even on it."""
_STEPS = 60


def learning_figures(runs: Ensemble) -> list[Figure]:
    """Return the reward per rollout and rollouts to solved; then the frozen policies."""
    groups = [group for group in runs.groups if len(group.figures("rollouts_to_solved"))]
    learning = [_rewards(groups), _learned(groups)]
    frozen = [_frozen(groups), _swings(groups), _times(groups)]
    return [
        *figure(
            lettered(
                learning,
                [
                    "Reward per rollout: interquartile mean over the seeds with its 95 % interval; a curve"
                    " that rises sooner learns faster; where bands overlap, the difference may be chance. On a"
                    f" logarithmic axis, means over at most {_STEPS} even steps. A finished run continues with the"
                    f" median of its last {_TAIL} greedy rollouts. After ten successes in a row a policy is frozen"
                    " until it fails or is solved.",
                    "Fraction of seeds solved after so many rollouts: a curve farther left learns faster, one that ends"
                    " below 100 % has unsolved seeds. Counted up to the first of the successes in a row that solve it.",
                ],
            ),
            learning,
        ),
        *figure(
            lettered(
                frozen,
                [
                    "Fraction of noisy rollouts of each frozen policy that end in the cup by noisy sight, seeds from"
                    " the worst to the best: a flat line at 100 % is a reliable method.",
                    "Half-swings that the frozen policy needs (median of its successes), by seed: fewer are better.",
                    "Time to the release of the frozen policy (median of its successes), by seed.",
                ],
            ),
            frozen,
            columns=3,
        ),
    ]


def _rewards(groups: Sequence[Group]) -> Panel | None:
    curves = [[rewards for member in group.members if len(rewards := _reward(member.log))] for group in groups]
    lengths = [len(rewards) for found in curves for rewards in found]
    if not lengths:
        return None
    slowest = max(float(np.quantile(group.figures("rollouts_to_solved"), 0.95)) for group in groups)
    shown = max(2, min(max(lengths) - 1, int(1.5 * slowest) + 10))
    with drawing("sweep-reward", "Reward per rollout over the seeds", height_in=3.2) as made:
        axes = made.axes()[0]
        for found, group, colour in zip(curves, groups, _colours(groups), strict=True):
            if found:
                matrix = np.array([_carried_on(reward, shown) for reward in found])
                index, matrix = _even_steps(matrix) if shown > _LONG else (np.arange(1.0, shown + 1), matrix)
                if (band := interquartile_interval(matrix)) is not None:
                    band = np.clip(band, matrix.min(), matrix.max())  # Student's t knows no bounds of the reward
                    axes.fill_between(index, *band, color=colour, alpha=0.16, lw=0, label=f"_{group.legend}, 95 %")
                axes.plot(index, interquartile_mean(matrix), color=colour, lw=1.5, label=group.legend)
        axes.set_xlabel("rollout")
        axes.set_ylabel("reward")
        if shown > _LONG:
            axes.set_xscale("log")
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter("")
        else:
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlim(1, shown)
        _legend(axes, groups)
    return made.panel("Reward per rollout")


def _reward(log: StageLog) -> Array:
    """Return the rewards of a run, and after its last one the reward that it keeps; empty without rollouts."""
    rollouts = log.table("/learn/rollout", RolloutMessage)
    if rollouts.empty:
        return np.empty(0)
    reward = rollouts["reward"].to_numpy(np.float64)
    greedy = reward[~rollouts["explored"].to_numpy(bool)]
    return np.append(reward, np.median(greedy[-_TAIL:]) if len(greedy) else reward[-1])


def _carried_on(reward: Array, n: int) -> Array:
    return np.concatenate([reward[:-1], np.full(max(0, n - len(reward) + 1), reward[-1])])[:n]


def _even_steps(matrix: Array) -> tuple[Array, Array]:
    """Return the means of curves (k, rollouts) over steps (n,) that are even on a logarithmic axis: their centres,
    and (k, n).
    """
    edges = np.unique(np.rint(np.geomspace(1, matrix.shape[1] + 1, _STEPS + 1)).astype(int))
    means = np.add.reduceat(matrix, edges[:-1] - 1, axis=1) / np.diff(edges)
    return np.sqrt(edges[:-1] * (edges[1:] - 1.0)), means


def _learned(groups: Sequence[Group]) -> Panel | None:
    if not groups:
        return None
    with drawing("sweep-learned", "Share of seeds solved over rollouts", height_in=3.2) as made:
        axes = made.axes()[0]
        maximum = max(float(group.figures("rollouts_to_solved").max()) for group in groups)
        for group, colour in zip(groups, _colours(groups), strict=True):
            values = np.sort(
                [
                    value
                    for member in group.members
                    if member.log.metrics.get("solved") is not False
                    and (value := member.figure("rollouts_to_solved")) is not None
                ]
            )
            fraction = np.arange(1, len(values) + 1) / len(group.members)
            end = fraction[-1] if len(fraction) else 0.0
            at, height = [0, *values, maximum * 1.04], [0, *fraction, end]
            axes.step(at, height, where="post", color=colour, lw=1.5, label=group.legend)
        smallest = min(float(group.figures("rollouts_to_solved").min()) for group in groups)
        if maximum > 30 * max(1.0, smallest):
            axes.set_xscale("symlog", linthresh=10)
            axes.xaxis.set_major_formatter("{x:g}")
        else:
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlim(0, maximum * 1.04)
        axes.set_ylim(0, 1.02)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
        axes.set_xlabel("rollouts to solved")
        axes.set_ylabel("seeds solved")
        _legend(axes, groups)
    return made.panel("Rollouts to solved")


def _frozen(groups: Sequence[Group]) -> Panel | None:
    found = [np.sort(group.figures("frozen_visual_caught_rate")) for group in groups]
    if not any(len(rates) for rates in found):
        return None
    with drawing("sweep-frozen", "Catches of the frozen policies", height_in=2.6, width_in=3.4) as made:
        axes = made.axes()[0]
        for rates, group, colour in zip(found, groups, _colours(groups), strict=True):
            fraction = (np.arange(len(rates)) + 0.5) / max(1, len(rates))
            axes.plot(fraction, rates, ".-", color=colour, lw=1.0, ms=3.5, label=group.legend)
        lowest = min(float(rates.min()) for rates in found if len(rates))
        axes.set_ylim(min(0.9, lowest - 0.02), 1.005)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(PercentFormatter(1.0, decimals=0))
        axes.set_xlabel("seeds, from worst to best")
        axes.set_ylabel("caught")
        _legend(axes, groups)
    return made.panel("Frozen policies")


def _swings(groups: Sequence[Group]) -> Panel | None:
    found = [group.figures("half_swings") for group in groups]
    if not any(len(swings) for swings in found):
        return None
    with drawing("sweep-swings", "Half-swings to the goal", height_in=2.6, width_in=3.4) as made:
        axes = made.axes()[0]
        width = 0.8 / len(groups)
        for row, (swings, group, colour) in enumerate(zip(found, groups, _colours(groups), strict=True)):
            kinds, counts = np.unique(np.round(swings), return_counts=True)
            at = kinds + width * (row - (len(groups) - 1) / 2)
            axes.bar(at, counts, 0.9 * width, color=colour, lw=0, label=group.legend)
        rounded = np.round(np.concatenate(found))
        axes.set_xlim(rounded.min() - 1.5, rounded.max() + 1.5)
        axes.xaxis.set_major_locator(MultipleLocator(1))
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        axes.grid(visible=False, axis="x")
        axes.set_xlabel("half-swings")
        axes.set_ylabel("seeds")
        _legend(axes, groups)
    return made.panel("Half-swings to the goal")


def _times(groups: Sequence[Group]) -> Panel | None:
    found = [group.figures("time_to_goal_s") for group in groups]
    known = [times for times in found if len(times)]
    if not known:
        return None
    low, high = min(float(times.min()) for times in known), max(float(times.max()) for times in known)
    edges = np.linspace(low - 0.02, high + 0.02, 25).tolist()
    with drawing("sweep-times", "Time to the goal", height_in=2.6, width_in=3.4) as made:
        axes = made.axes()[0]
        for times, group, colour in zip(found, groups, _colours(groups), strict=True):
            alpha = 0.25 if len(groups) > 1 else 0.75
            axes.hist(times, edges, color=colour, alpha=alpha, lw=0, label=f"_{group.legend}")
            axes.hist(times, edges, color=colour, histtype="step", lw=1.1, label=group.legend)
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("time to the goal [s]")
        axes.set_ylabel("seeds")
        _legend(axes, groups)
    return made.panel("Time to the goal")


def _colours(groups: Sequence[Group]) -> list[str]:
    return [SERIES[index % len(SERIES)] for index in range(len(groups))]


def _legend(axes: Axes, groups: Sequence[Group]) -> None:
    if len(groups) > 1:
        legend_above(axes, columns=min(3, len(groups)))


CHAPTER = EnsembleChapter(
    title="Swing-up without prior knowledge",
    lead="Learned from nothing, once for each seed.",
    topics=("/learn/rollout",),
    figures=learning_figures,
    tables=learning_tables,
    headline=(
        Headline("rollouts_to_solved", "rollouts to solved, mean over the seeds; the cap counts for unsolved ones"),
        Headline("frozen_visual_caught_rate", "of swing-ups by the frozen policies end in the cup, by noisy sight"),
        Headline("half_swings", "half-swings to the goal, mean"),
    ),
)
