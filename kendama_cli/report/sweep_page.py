"""The report of several runs side by side: one self-contained HTML page, made from their MCAP logs alone."""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.report.ensemble import Ensemble, Run, ensemble
from kendama_cli.report.figure import Figure
from kendama_cli.report.grid import EMPTY, Cell, grid, quantity
from kendama_cli.report.style import CSS
from kendama_cli.report.tables import label_and_unit, settings_table
from kendama_cli.stages.learn.chapter_learning_sweep import TOPICS as LEARNING_TOPICS
from kendama_cli.stages.learn.chapter_learning_sweep import learning_figures, learning_tables
from kendama_cli.stages.transfer.chapter_transfer_sweep import TOPICS as TRANSFER_TOPICS
from kendama_cli.stages.transfer.chapter_transfer_sweep import transfer_sweep_figures, transfer_table


@dataclass(frozen=True)
class _Chapter:
    title: str
    lead: str
    topics: tuple[str, ...]
    figures: Callable[[Ensemble], list[Figure]]
    tables: Callable[[Ensemble], str]


def _figures(runs: Ensemble) -> list[Figure]:
    return []


def _metrics(runs: Ensemble) -> str:
    """The median of every number in the metrics, and the range where it differs."""
    names = dict.fromkeys(name for group in runs.groups for member in group.members for name in member.log.metrics)
    shown = [name for name in names if any(len(group.figures(name)) for group in runs.groups)]
    rows = []
    for group in runs.groups:
        cells = [Cell(group.label), Cell(str(len(group.members)))]
        for name in shown:
            values = group.figures(name)
            note = f"{quantity(values.min())} … {quantity(values.max())}" if len(values) and np.ptp(values) else ""
            cells.append(Cell(quantity(float(np.median(values))), note) if len(values) else EMPTY)
        rows.append(cells)
    head = [runs.differs, "logs"]
    for name in shown:
        label, unit = label_and_unit(name)
        head.append(f"{label} [{unit}]" if unit else label)
    return grid(head, rows)


_CHAPTERS = {
    "learn": _Chapter(
        "Swing-up without prior knowledge",
        "SARSA(λ) learns from nothing, once for each seed.",
        LEARNING_TOPICS,
        learning_figures,
        learning_tables,
    ),
    "transfer": _Chapter(
        "Transfer to other bodies",
        "The table goes to hardware that is not what it was learned on, and the learning goes on there.",
        TRANSFER_TOPICS,
        transfer_sweep_figures,
        transfer_table,
    ),
}
_HEADLINES = (
    ("learn", "rollouts_to_learn", "rollouts to learn, mean over the seeds", False),
    ("learn", "frozen_success_rate", "of swing-ups by the frozen tables succeed", True),
    ("learn", "swings", "half-swings to the goal, mean", False),
    ("transfer", "rollouts", "further rollouts on the hardware, mean", False),
    ("transfer", "rollouts_from_scratch", "rollouts there from scratch, mean", False),
    ("transfer", "success_rate_after", "of swing-ups succeed on the hardware", True),
)

_FEW = 3


def make_sweep_report(title: str, runs: Sequence[Run]) -> str:
    """The page for ``runs``, under ``title``: of each its document (``overrides``, ``stages``) and its stages' logs.

    Runs are grouped by the overrides in which they differ, the seed excepted. The same runs and logs give the same
    bytes. Raises InputError for a log that cannot be read.
    """
    stages = list(dict.fromkeys(stage for document, logs in runs for stage in (*_names(document), *logs)))
    gathered = {}
    for stage in stages:
        chapter = _CHAPTERS.get(stage)
        gathered[stage] = ensemble(runs, stage, chapter.topics if chapter else ())
    figures = 0
    sections = []
    for stage, found in gathered.items():
        section, figures = _section(stage, found, figures)
        sections.append(section)
    told = title or f"{len(runs)} runs"
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1"><link rel="icon" href="data:,">'
        f"<title>{html.escape(f'kendama: {told}')}</title>\n<style>{CSS}</style></head>\n<body><main>"
        "<h1>Ball in a cup: many runs side by side</h1>"
        f'<p class="run">{html.escape(told)}</p>'
        f"{_contents(gathered)}{_headlines(gathered)}{''.join(sections)}"
        "<footer>Made by kendama from the logs of these runs alone. Runs that share a log count it once.</footer>"
        "</main></body></html>\n"
    )


def _names(document: object) -> list[str]:
    entries = document.get("stages", ()) if isinstance(document, dict) else ()
    return [str(entry["name"]) for entry in entries]


def _contents(gathered: dict[str, Ensemble]) -> str:
    items = []
    for stage in gathered:
        title = _CHAPTERS[stage].title if stage in _CHAPTERS else stage
        items.append(f'<li><a href="#{html.escape(stage)}">{html.escape(title)}</a></li>')
    return f'<ul class="contents">{"".join(items)}</ul>'


def _headlines(gathered: dict[str, Ensemble]) -> str:
    """The figures at a glance: of few groups each one's, of many the mean over the groups."""
    results = []
    for stage, metric, words, share in _HEADLINES:
        groups = [
            group for group in (gathered[stage].groups if stage in gathered else ()) if len(group.figures(metric))
        ]
        means = [float(group.figures(metric).mean()) for group in groups]
        if 1 < len(groups) <= _FEW and stage == "learn":
            results += [
                _result(mean, f"{words}: {group.label}", share) for mean, group in zip(means, groups, strict=True)
            ]
        elif groups and (stage != "learn" or len(groups) == 1):
            results.append(_result(float(np.mean(means)), words, share))
    return f'<dl class="results">{"".join(results)}</dl>' if results else ""


def _result(value: float, words: str, share: bool) -> str:
    shown = f"{quantity(100 * value)}<small>%</small>" if share else quantity(value)
    return f"<div><dt>{html.escape(words)}</dt><dd>{shown}</dd></div>"


def _section(stage: str, found: Ensemble, figures: int) -> tuple[str, int]:
    """The chapter of one stage, and the number of figures up to its end."""
    chapter = _CHAPTERS.get(stage, _Chapter(stage, "", (), _figures, _metrics))
    what = html.escape(stage)
    parts = [
        f'<section id="{what}"><header><h2>{html.escape(chapter.title)}</h2><span class="what">{what}</span></header>'
    ]
    if chapter.lead:
        parts.append(f"<p>{html.escape(chapter.lead)}</p>")
    if found.failed:
        lines = "<br>".join(html.escape(line) for line in found.failed)
        parts.append(f'<p class="notice">In {len(found.failed)} of the runs this stage has no log:<br>{lines}</p>')
    if found.groups:
        for shown in chapter.figures(found):
            figures += 1
            parts.append(shown.html(figures))
        parts.append(chapter.tables(found))
        first = found.groups[0].members[0]
        parts.append(settings_table(first.log.settings))
    parts.append("</section>")
    return "".join(parts), figures
