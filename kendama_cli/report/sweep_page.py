"""The report of several runs side by side: one self-contained HTML page, made from their MCAP logs alone."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence

import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.report.chapters import EnsembleChapter, declaration_of, ensemble_chapter, undrawn
from kendama_cli.report.ensemble import Ensemble, Run, ensemble
from kendama_cli.report.figure import save_script
from kendama_cli.report.grid import EMPTY, Cell, grid, quantity
from kendama_cli.report.origin import robot_of
from kendama_cli.report.page_head import page_head
from kendama_cli.report.receiver import receiving
from kendama_cli.report.tables import label_and_unit, settings_table

_FEW = 3
"""So many groups have each their own headline figure."""


def _metrics(runs: Ensemble, stage: str) -> str:
    """Return the median of every number in the metrics, and the range where it differs."""
    names = dict.fromkeys(name for group in runs.groups for member in group.members for name in member.log.metrics)
    shown = [name for name in names if any(len(group.figures(name)) for group in runs.groups)]
    rows = []
    for group in runs.groups:
        cells = [group.cell(), Cell(str(len(group.members)))]
        for name in shown:
            values = group.figures(name)
            note = f"{quantity(values.min())} … {quantity(values.max())}" if len(values) and np.ptp(values) else ""
            told = {"": float(np.median(values)), "min": values.min(), "max": values.max()} if len(values) else {}
            cells.append(Cell(quantity(float(np.median(values))), note, told) if len(values) else EMPTY)
        rows.append(cells)
    head = [runs.differs, "logs"]
    for name in shown:
        label, unit = label_and_unit(name)
        head.append(f"{label} [{unit}]" if unit else label)
    return grid(head, rows, name=f"{stage}-metrics")


def make_sweep_report(title: str, runs: Sequence[Run]) -> str:
    """Return the page for ``runs``, under ``title``: of each its document (``overrides``, ``stages``) and its stages'
    logs.

    Runs are grouped by the overrides in which they differ, the seed excepted. The same runs and logs give the same
    bytes. Raises InputError for a log that cannot be read.
    """
    entries = {str(entry["name"]): entry for document, _ in runs for entry in document.get("stages", ())}
    stages = list(dict.fromkeys([*entries, *(stage for _, logs in runs for stage in logs)]))
    chapters = {stage: _chapter(stage, entries.get(stage, {})) for stage in stages}
    gathered = {stage: ensemble(runs, stage, chapters[stage].topics) for stage in stages}
    figures = 0
    sections = []
    for stage, found in gathered.items():
        section, figures = _section(stage, chapters[stage], found, figures)
        sections.append(section)
    described = title or f"{len(runs)} runs"
    return (
        f"{page_head(f'kendama: {described}', save_script())}<body><main>"
        "<h1>Ball in a cup: many runs side by side</h1>"
        f'<p class="run">{html.escape(described)}</p>'
        f"{_contents(chapters)}{_headlines(chapters, gathered)}{''.join(sections)}"
        "<footer>Made by kendama from the logs of these runs alone. Runs that share a log count it once.</footer>"
        f"</main><script>{save_script()}</script></body></html>\n"
    )


def _chapter(stage: str, entry: Mapping[str, object]) -> EnsembleChapter:
    """Return the stage's own chapter of a comparison, or the table of its metrics."""
    declaration = declaration_of(stage, entry)
    title = declaration.title if declaration else stage
    plain = EnsembleChapter(title, "", (), lambda _: [], lambda runs: _metrics(runs, stage))
    return ensemble_chapter(declaration) or plain


def _contents(chapters: Mapping[str, EnsembleChapter]) -> str:
    items = [
        f'<li><a href="#{html.escape(stage)}">{html.escape(chapter.title)}</a></li>'
        for stage, chapter in chapters.items()
    ]
    return f'<ul class="contents">{"".join(items)}</ul>'


def _headlines(chapters: Mapping[str, EnsembleChapter], gathered: Mapping[str, Ensemble]) -> str:
    """Return the figures at a glance: the mean over the groups where that says something, else of few groups each
    one's.
    """
    results = []
    for stage, chapter in chapters.items():
        for headline in chapter.headline:
            every = gathered[stage].groups
            groups = [group for group in every if len(group.figures(headline.metric))]
            robots = {robot_of(one.log.settings) for group in groups for one in group.members}
            words = headline.of(robots.pop() if len(robots) == 1 else "the robot")
            means = [float(group.figures(headline.metric).mean()) for group in groups]
            share = headline.metric.endswith("_rate") or "_rate_" in headline.metric
            if groups and (chapter.pooled or len(every) == 1):
                results.append(_result(float(np.mean(means)), words, share))
            elif len(every) <= _FEW:
                results += [
                    _result(mean, f"{words}: {group.label}", share) for mean, group in zip(means, groups, strict=True)
                ]
    return f'<dl class="results">{"".join(results)}</dl>' if results else ""


def _result(value: float, words: str, share: bool) -> str:
    shown = f"{quantity(100 * value)}<small>%</small>" if share else quantity(value)
    return f"<div><dt>{html.escape(words)}</dt><dd>{shown}</dd></div>"


def _section(stage: str, chapter: EnsembleChapter, found: Ensemble, figures: int) -> tuple[str, int]:
    """Return the chapter of one stage, and the number of figures up to its end."""
    if (receiver := receiving()) is not None:
        receiver.chapter(stage)
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
        try:
            drawn, tables = chapter.figures(found), chapter.tables(found)
        except InputError:
            raise
        except Exception as error:  # as for a chapter of one run: the page goes on
            drawn, tables = [], f'<p class="notice">{html.escape(undrawn(error))}</p>{_metrics(found, stage)}'
        for shown in drawn:
            figures += 1
            parts.append(shown.html(figures))
        parts.append(tables)
        parts.append(settings_table(*(group.members[0].log.settings for group in found.groups)))
    parts.append("</section>")
    return "".join(parts), figures
