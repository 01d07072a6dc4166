"""The report of a run: one self-contained HTML page, made from the stages' MCAP logs alone."""

from __future__ import annotations

import html
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kendama_cli.report.animation import SCRIPT
from kendama_cli.report.chapters import declaration_of, draw, film, performances
from kendama_cli.report.figure import save_script
from kendama_cli.report.origin import robot_of
from kendama_cli.report.page_head import page_head
from kendama_cli.report.receiver import receiving
from kendama_cli.report.replay.page_part import replay, scripts
from kendama_cli.report.source import StageLog, is_number
from kendama_cli.report.tables import label_and_unit, metrics_table, number, settings_table
from kendama_cli.schema.declaration import Headline, StageDeclaration

_MOST_RESULTS = 6

Declarations = Mapping[str, StageDeclaration | None]
"""The declaration behind each stage of the run; None for one whose package is not installed."""


def make_report(run: Mapping[str, Any], logs: Mapping[str, Path]) -> str:
    """Return the page for ``run`` (its ``run`` id, ``pipeline``, and ``stages`` with ``name`` and ``status``).

    ``logs`` gives the MCAP log of every stage that has one; all figures, metrics and settings come from there. The
    same run and logs give the same bytes. Raises InputError for a log that cannot be read.
    """
    stages = {str(stage["name"]): stage for stage in run.get("stages", ())}
    names = [*stages, *(name for name in logs if name not in stages)]
    sources = {name: StageLog(path) for name, path in logs.items()}
    declarations = {name: declaration_of(name, stages.get(name, {})) for name in names}
    figures = 0
    sections = []
    for name in names:
        shown_section, figures = section(name, declarations[name], stages.get(name, {}), sources.get(name), figures)
        sections.append(shown_section)
    title = f"kendama: run {run.get('run', '')}".strip()
    described = f"Run {run.get('run', '?')}" + (f", pipeline {run['pipeline']}" if run.get("pipeline") else "")
    if run.get("overrides"):
        described += ", with " + " ".join(map(str, run["overrides"]))
    shown = _replay(declarations, sources)
    run_scripts = (SCRIPT, save_script(), *(scripts() if shown else ()))
    return (
        f"{page_head(title, *run_scripts)}<body><main>"
        f"<h1>{html.escape(_heading(declarations))}</h1>"
        f'<p class="run">{html.escape(described)}</p>'
        f"{_contents(declarations, sources)}{shown}{_head(declarations, sources)}{''.join(sections)}"
        "<footer>Made by kendama from the logs of this run alone. Times are simulated or recorded time. Positions are"
        " relative to where the cup begins: x along the swing, z up. Blue is the cup, vermilion the ball; green and"
        " filled is a success.</footer></main>"
        f"{''.join(f'<script>{text}</script>' for text in run_scripts)}</body></html>\n"
    )


def _heading(declarations: Declarations) -> str:
    only = next(iter(declarations.values())) if len(declarations) == 1 else None
    return only.title if only is not None else "Ball in a cup: from a swing to a robot’s catch"


def _contents(declarations: Declarations, sources: Mapping[str, StageLog]) -> str:
    items = []
    for name, declaration in declarations.items():
        off = "" if name in sources else ' class="off"'
        title = declaration.title if declaration else name
        items.append(f'<li{off}><a href="#{html.escape(name)}">{html.escape(title)}</a></li>')
    return f'<ul class="contents">{"".join(items)}</ul>'


def _head(declarations: Declarations, sources: Mapping[str, StageLog]) -> str:
    """Return the first film that a stage offers, beside the run's headline figures."""
    shown = [
        (declaration, sources[name]) for name, declaration in declarations.items() if declaration and name in sources
    ]
    moving = next(filter(None, (film(declaration, log) for declaration, log in shown)), "")
    results = "".join(
        f"<div><dt>{html.escape(one.of(robot_of(log.settings)))}</dt>"
        f"<dd>{_result(one.metric, log.metrics[one.metric])}</dd></div>"
        for one, log in _headlines([(declaration.headline, log) for declaration, log in shown])
    )
    table = f'<dl class="results">{results}</dl>' if results else ""
    moving = f'<div class="flat">{moving}</div>' if moving else ""
    return f'<div class="hero">{moving}{table}</div>' if moving and table else moving + table


def _replay(declarations: Declarations, sources: Mapping[str, StageLog]) -> str:
    """Return what the stages' logs moved, in space; empty where none of them moved a ball."""
    found = [
        one
        for name, declaration in declarations.items()
        if declaration and name in sources
        for one in performances(declaration, sources[name])
    ]
    return replay(found) if receiving() is None and any("ball" in one.bodies.names for one in found) else ""


def _headlines(offered: list[tuple[tuple[Headline, ...], StageLog]]) -> list[tuple[Headline, StageLog]]:
    """Return the headline figures that the logs have: every stage's first before any stage's second, in the run's
    order.
    """
    found = []
    for stage, (headlines, log) in enumerate(offered):
        known = [one for one in headlines if is_number(log.metrics.get(one.metric))]
        found += [(place, stage, headline, log) for place, headline in enumerate(known)]
    best = sorted(found, key=lambda item: item[:2])[:_MOST_RESULTS]
    return [(headline, log) for _, _, headline, log in sorted(best, key=lambda item: (item[1], item[0]))]


def _result(metric: str, value: float) -> str:
    unit = label_and_unit(metric)[1]
    if metric.endswith("_rate") or "_rate_" in metric:
        shown, unit = f"{100 * value:.0f}", "%"
    elif metric.endswith("_scale"):
        shown = f"{value:.3f}"
    else:
        shown = f"{value:.3g}" if isinstance(value, float) else number(value)
    return html.escape(shown) + (f"<small>{html.escape(unit)}</small>" if unit else "")


def section(
    name: str, declaration: StageDeclaration | None, stage: Mapping[str, Any], log: StageLog | None, figures: int
) -> tuple[str, int]:
    """Return the chapter of one stage, and the number of figures up to its end."""
    if (receiver := receiving()) is not None:
        receiver.chapter(name)
    what = html.escape(name)
    title = declaration.title if declaration else name
    parts = [f'<section id="{what}"><header><h2>{html.escape(title)}</h2><span class="what">{what}</span></header>']
    if declaration and declaration.lead:
        parts.append(f"<p>{html.escape(declaration.lead)}</p>")
    if stage.get("status") == "failed":
        error = stage.get("error")
        parts.append(_notice(f"This stage failed: {error}" if error else "This stage failed."))
    elif log is None:
        parts.append(_notice("This stage has no log: it did not run, or did not end."))
    if log is not None:
        drawn, problem = draw(declaration, log) if declaration else ([], "")
        for shown in drawn:
            figures += 1
            parts.append(shown.html(figures, declaration.figures if declaration else None))
        if problem:
            parts.append(_notice(problem))
        parts += [_notice(warning) for warning in str(log.metrics.get("warnings") or "").splitlines()]
        figures_told = {metric: value for metric, value in log.metrics.items() if metric != "warnings"}
        meanings = declaration.metrics if declaration else None
        parts += [metrics_table(figures_told, meanings), settings_table(log.settings)]
    parts.append("</section>")
    return "".join(parts), figures


def _notice(sentence: str) -> str:
    return f'<p class="notice">{html.escape(sentence)}</p>'
