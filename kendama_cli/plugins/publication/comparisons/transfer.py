"""Transfer over several bodies and seeds: what the table is worth there, against learning from scratch."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from kendama_cli.report.chapters import EnsembleChapter
from kendama_cli.report.ensemble import Ensemble, Group
from kendama_cli.report.figure import Figure, Panel, figure
from kendama_cli.report.grid import EMPTY, Cell, grid, percent, quantity, with_interval
from kendama_cli.report.intervals import mean_interval, ratio_interval
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.style import BALL, CUP, INK, PAPER
from kendama_cli.report.tracks import Array
from kendama_cli.schema.declaration import Headline

_HEAD = ("body", "seeds", "from Q", "from scratch", "ratio", "frozen, before", "frozen, after", "games caught")
_ALSO = (
    ("rollouts_to_solved", "to solved"),
    ("imitation_caught_at", "imitation caught at"),
    ("imitation_caught_rate", "imitation caught"),
)
"""Metrics that not every pipeline and choice of ``transfer`` has, and the columns that they are told in where there."""
_FAILED = (
    ("learned", "from Q"),
    ("learned_from_scratch", "from scratch"),
    ("solved", "to solved"),
    ("imitation_caught", "imitation"),
)
"""Metrics that are False where a seed failed, and the words for it."""
_TWIN: tuple[tuple[str, float | None, Callable[[float], str]], ...] = (
    ("rope_scale", None, lambda value: f"rope {100 * (value - 1):+.0f} %".replace("-", "−")),
    ("lag_s", None, lambda value: f"lag {1e3 * value:.0f} ms"),
    ("latency_s", None, lambda value: f"latency {1e3 * value:.0f} ms"),
    ("ball_noise_m", None, lambda value: f"marker {1e3 * value:g} mm"),
    ("mass_scale", 1.0, lambda value: f"ball's mass × {value:g}"),
    ("drag_scale", 1.0, lambda value: f"air × {value:g}"),
    ("tie_friction_m", 0.0, lambda value: f"tie rubs at {1e3 * value:g} mm"),
    ("gravity_tilt_rad", 0.0, lambda value: f"tilt {math.degrees(value):.2g}°"),
    ("backlash_rad", 0.0, lambda value: f"backlash {math.degrees(value):.2g}°"),
    ("drift_m", 0.0, lambda value: f"drift {1e3 * value:g} mm"),
    ("tracking_delay_s", 0.0, lambda value: f"tracking {1e3 * value:.0f} ms late"),
    ("tracking_lost_fraction", 0.0, lambda value: f"{100 * value:g} % of it lost"),
)
"""Imperfections of a twin: the name, the value that is not worth a word (None: any is), and the words."""


def transfer_sweep_figures(runs: Ensemble) -> list[Figure]:
    """Draw further rollouts of every seed, from the table and from scratch, for each group."""
    groups = [group for group in runs.groups if len(group.figures("rollouts"))]
    compared = any(len(group.figures("rollouts_from_scratch")) for group in groups)
    caption = "Further rollouts needed on the robot, a mark for each seed and a bar for their mean, starting with the"
    caption += " table learned in simulation"
    caption += ", and with an empty table on the same body: what lies between is gained." if compared else "."
    return figure([caption], [_further(groups)], columns=1)


def transfer_table(runs: Ensemble) -> str:
    """Return a line for each group (from Q, from scratch, the frozen table before and after) and the mean of all."""
    groups = [
        group for group in runs.groups if any(len(group.figures(one)) for one in ("rollouts", "imitation_caught"))
    ]
    if not groups:
        return ""
    also = [(metric, word) for metric, word in _ALSO if any(len(group.figures(metric)) for group in groups)]
    rows = [_row(group, also) for group in groups]
    foot = _foot(groups, also) if len(groups) > 1 else []
    failed = [
        f"{group.label} {what}: seed {', '.join(seeds)}"
        for group in groups
        for metric, what in _FAILED
        if (seeds := [member.seed or "–" for member in group.members if member.log.metrics.get(metric) is False])
    ]
    note = (
        "Rollouts on the robot up to the first of ten greedy successes in a row; a failure counts as the cap. Below"
        " means and ratios their 95 % intervals, below success rates the exact 95 % interval over all"
        " trials, or of the mean where evaluations ended early."
    )
    note = (f"Not learned or caught: {'; '.join(failed)}. " if failed else "") + note
    head = (*_HEAD, *(word for _, word in also))
    table = grid(head, rows, name="transfer-rollouts", title="Further rollouts on each body", foot=foot)
    return f'{table}<p class="note">{html.escape(note)}</p>'


def _row(group: Group, also: Sequence[tuple[str, str]]) -> list[Cell]:
    given, scratch = group.figures("rollouts"), group.figures("rollouts_from_scratch")
    ratio = EMPTY
    if len(scratch):
        ratio = with_interval(float(given.mean() / scratch.mean()), ratio_interval(given, scratch))
    return [
        group.cell(_body(group.members[0].log.settings)),
        Cell(str(max(len(given), len(group.figures("imitation_caught"))))),
        _mean(given),
        _mean(scratch),
        ratio,
        _rate(group, "success_rate_before", "evaluation_rollouts"),
        _rate(group, "success_rate_after", "evaluation_rollouts"),
        _rate(group, "caught_rate", "games"),
        *(_further_cell(group, metric) for metric, _ in also),
    ]


def _further_cell(group: Group, metric: str) -> Cell:
    if metric.endswith("_rate"):
        return _rate(group, metric, "imitation_repeats")
    return _mean(group.figures(metric))


def _mean(values: Array) -> Cell:
    return with_interval(float(values.mean()), mean_interval(values)) if len(values) else EMPTY


def _foot(groups: Sequence[Group], also: Sequence[tuple[str, str]]) -> list[Cell]:
    def mean(metric: str) -> float | None:
        means = [float(found.mean()) for group in groups if len(found := group.figures(metric))]
        return float(np.mean(means)) if means else None

    def worst(metric: str) -> str:
        means = [float(found.mean()) for group in groups if len(found := group.figures(metric))]
        return f"worst {percent(min(means)).text}" if means else ""

    given, scratch = mean("rollouts"), mean("rollouts_from_scratch")
    ratio = given / scratch if given is not None and scratch else None
    return [
        Cell("mean"),
        Cell(""),
        Cell(quantity(given)),
        Cell(quantity(scratch)),
        Cell(quantity(ratio)),
        *(percent(mean(metric), worst(metric)) for metric in ("success_rate_before", "success_rate_after")),
        percent(mean("caught_rate"), worst("caught_rate")),
        *(
            percent(mean(metric), worst(metric)) if metric.endswith("_rate") else Cell(quantity(mean(metric)))
            for metric, _ in also
        ),
    ]


def _rate(group: Group, metric: str, trials: str) -> Cell:
    rates = group.figures(metric)
    if not len(rates):
        return EMPTY
    each = int(group.members[0].log.setting("transfer", trials, default=0))
    played = group.figures(trials)  # of evaluations that always play all there is none
    return percent(float(rates.mean()), between=group.rate_between(metric, played, each))


def _body(settings: Mapping[str, Any]) -> str:
    """Return the imperfections of the twin, in a few words."""
    made = settings.get("hardware", {}).get("imperfection", {})
    known = ((made.get(name), without, show) for name, without, show in _TWIN)
    return ", ".join(
        show(value) for value, without, show in known if isinstance(value, int | float) and value != without
    )


def _further(groups: Sequence[Group]) -> Panel | None:
    if not groups:
        return None
    height_in = 1.2 + 0.36 * len(groups)
    with drawing("sweep-transfer", "Further rollouts for each body", height_in=height_in, width_in=9.0) as made:
        axes = made.axes()[0]
        kinds = (("rollouts_from_scratch", BALL, 0.14, "from scratch"), ("rollouts", CUP, -0.14, "from Q"))
        for metric, colour, shift, label in kinds:
            for row, group in enumerate(groups):
                values = group.figures(metric)
                if len(values):
                    name = f"_{group.label}, {label}"
                    marks: dict[str, Any] = {"color": colour, "mfc": PAPER, "ms": 4, "mew": 0.9, "label": name}
                    axes.plot(values, row + shift + _spread(values), "o", **marks)
                    mean = float(values.mean())
                    axes.plot(
                        [mean, mean],
                        [row + shift - 0.13, row + shift + 0.13],
                        color=colour,
                        lw=2.6,
                        label=f"{name}, mean",
                    )
            if any(len(group.figures(metric)) for group in groups):
                axes.plot([], [], "o", color=colour, mfc=PAPER, ms=4, mew=0.9, label=label)
        axes.set_yticks(range(len(groups)), [group.label for group in groups])
        axes.set_ylim(len(groups) - 0.5, -0.5)
        axes.tick_params(axis="y", labelcolor=INK, length=0)
        axes.grid(visible=False, axis="y")
        axes.set_xlim(left=0)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("further rollouts")
        legend_above(axes)
    return made.panel("Further rollouts on the robot")


def _spread(values: Array) -> Array:
    """Return small shifts that keep equal marks apart: the k-th of equal values lies k steps to one side."""
    seen: dict[float, int] = {}
    shifts = []
    for value in values.tolist():
        seen[value] = seen.get(value, 0) + 1
        k = seen[value]
        shifts.append(0.02 * (k // 2) * (1 if k % 2 else -1))
    return np.clip(shifts, -0.12, 0.12)


CHAPTER = EnsembleChapter(
    title="Transfer to other bodies",
    lead="Learning continues on a robot that differs from the model.",
    topics=(),
    figures=transfer_sweep_figures,
    tables=transfer_table,
    headline=(
        Headline("rollouts", "further rollouts on {robot}, mean"),
        Headline("rollouts_from_scratch", "rollouts there from scratch, mean"),
        Headline("success_rate_after", "of swing-ups succeed on {robot}"),
    ),
    pooled=True,
)
