"""The report of a run: one self-contained HTML page, made from the stages' MCAP logs alone."""

from __future__ import annotations

import html
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from kendama_cli.report.animation import SCRIPT, player
from kendama_cli.report.figure import Figure
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import CSS
from kendama_cli.report.tables import label_and_unit, metrics_table, number, settings_table
from kendama_cli.report.tracks import Geometry, catch_time_s, pair
from kendama_cli.stages.adapt.chapter import adaptation_figures
from kendama_cli.stages.encode.chapter_imitation import capture_figures, encode_figures
from kendama_cli.stages.identify.chapter import identification_figures
from kendama_cli.stages.interact.chapter import interaction_figures
from kendama_cli.stages.learn.chapter import swingup_figures
from kendama_cli.stages.predict.chapter import prediction_figures
from kendama_cli.stages.transfer.chapter import transfer_figures

_CHAPTERS: dict[str, tuple[str, str, Callable[[StageLog], list[Figure]]]] = {
    "capture": ("Demonstration", "A person's swings, recorded at the hand that holds the cup.", capture_figures),
    "encode": (
        "Movement primitive",
        "Every coordinate becomes a dynamic movement primitive; its parameters are averaged over the demonstrations.",
        encode_figures,
    ),
    "identify": (
        "Friction identification",
        "The arm moves its joints at all speeds; what its torques do not explain is friction that nobody modelled.",
        identification_figures,
    ),
    "adapt": (
        "Adaptation",
        "An arm plays the primitive in simulation, and its time scale is searched until the ball lands in the cup.",
        adaptation_figures,
    ),
    "learn": (
        "Swing-up without prior knowledge",
        "SARSA(λ) learns from nothing to swing the ball up, driven by random harmonic motions while it explores.",
        swingup_figures,
    ),
    "predict": (
        "Catch prediction",
        "A camera watches the ball fly; from its images the pose for the catch is predicted.",
        prediction_figures,
    ),
    "transfer": (
        "Transfer to the robot",
        "Table and primitive go to the hardware (a simulated twin in a process of its own, unless configured otherwise)"
        ", and the learning goes on there.",
        transfer_figures,
    ),
    "interact": (
        "Force control in a scene",
        "An arm plays a script of poses and forces among bodies, its tool on springs in task space.",
        interaction_figures,
    ),
}
_RESULTS = (
    ("adapt", "success_rate", "of perturbed repeats caught by the adapted swing"),
    ("adapt", "tau_scale", "time scale tau of the catch"),
    ("encode", "rmse_mm", "error of the movement primitive"),
    ("learn", "rollouts_to_learn", "rollouts until the swing-up was learned"),
    ("learn", "frozen_success_rate", "of swing-ups by the frozen table succeed"),
    ("predict", "position_error_mm_p50", "median error of the predicted catch"),
    ("identify", "tracking_rms_mm_after", "error of the cup at speed, friction compensated"),
    ("transfer", "success_rate_after", "of swing-ups succeed on the hardware"),
    ("interact", "force_error_rms_n", "rms error of the force on what the arm touches"),
    ("transfer", "caught_rate", "of full games caught on the hardware"),
)
_MOST_RESULTS = 6


def make_report(run: Mapping[str, Any], logs: Mapping[str, Path]) -> str:
    """The page for ``run`` (its ``run`` id, ``pipeline``, and ``stages`` with ``name`` and ``status``).

    ``logs`` gives the MCAP log of every stage that has one; all figures, metrics and settings come from there. The
    same run and logs give the same bytes. Raises InputError for a log that cannot be read.
    """
    stages = {str(stage["name"]): stage for stage in run.get("stages", ())}
    names = [*stages, *(name for name in logs if name not in stages)]
    sources = {name: StageLog(path) for name, path in logs.items()}
    figures = 0
    sections = []
    for name in names:
        section, figures = _section(name, stages.get(name, {}), sources.get(name), figures)
        sections.append(section)
    title = f"kendama: run {run.get('run', '')}".strip()
    told = f"Run {run.get('run', '?')}" + (f", pipeline {run['pipeline']}" if run.get("pipeline") else "")
    if run.get("overrides"):
        told += ", with " + " ".join(map(str, run["overrides"]))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1"><link rel="icon" href="data:,">'
        f"<title>{html.escape(title)}</title>\n<style>{CSS}</style></head>\n<body><main>"
        f"<h1>{html.escape(_heading(names))}</h1>"
        f'<p class="run">{html.escape(told)}</p>'
        f"{_contents(names, sources)}{_hero(sources)}{''.join(sections)}"
        "<footer>Made by kendama from the logs of this run alone. Times are simulated or recorded time. Positions are"
        " relative to where the cup begins: x along the swing, z up. Blue is the cup, vermilion the ball; green and"
        " filled is a success.</footer></main>"
        f"<script>{SCRIPT}</script></body></html>\n"
    )


def _heading(names: list[str]) -> str:
    if len(names) == 1 and names[0] in _CHAPTERS:
        return _CHAPTERS[names[0]][0]
    return "Ball in a cup: from a person’s swing to a robot’s catch"


def _contents(names: list[str], sources: Mapping[str, StageLog]) -> str:
    items = []
    for name in names:
        off = "" if name in sources else ' class="off"'
        title = _CHAPTERS[name][0] if name in _CHAPTERS else name
        items.append(f'<li{off}><a href="#{html.escape(name)}">{html.escape(title)}</a></li>')
    return f'<ul class="contents">{"".join(items)}</ul>'


def _hero(sources: Mapping[str, StageLog]) -> str:
    """The film of the catch beside the run's headline figures."""
    film = ""
    adapt = sources.get("adapt")
    paths = pair(adapt, "/adapt") if adapt else None
    if adapt and paths:
        sizes = Geometry.of(adapt)
        caught_s = catch_time_s(*paths, sizes.cup_depth_m)
        film = player("catch", *paths, sizes, poster_s=None if caught_s is None else caught_s - 0.12, autoplay=True)
        film += "<p class=run style='margin:8px 0 0'>The adapted swing, played by the arm in simulation.</p>"
    results = []
    for stage, metric, words in _RESULTS:
        value = sources[stage].metrics.get(metric) if stage in sources else None
        if value is None or isinstance(value, bool | str):
            continue
        unit = label_and_unit(metric)[1]
        if metric.endswith("_rate") or "_rate_" in metric:
            shown, unit = f"{100 * value:.0f}", "%"
        else:
            shown = (
                f"{value:.3f}"
                if metric == "tau_scale"
                else f"{value:.3g}"
                if isinstance(value, float)
                else number(value)
            )
        results.append(
            f"<div><dt>{html.escape(words)}</dt><dd>{shown}{f'<small>{unit}</small>' if unit else ''}</dd></div>"
        )
    table = f'<dl class="results">{"".join(results[:_MOST_RESULTS])}</dl>' if results else ""
    if film and table:
        return f'<div class="hero"><div>{film}</div>{table}</div>'
    return film + table


def _section(name: str, stage: Mapping[str, Any], log: StageLog | None, figures: int) -> tuple[str, int]:
    """The chapter of one stage, and the number of figures up to its end."""
    title, lead, draw = _CHAPTERS.get(name, (name, "", lambda _: []))
    what = html.escape(name)
    parts = [f'<section id="{what}"><header><h2>{html.escape(title)}</h2><span class="what">{what}</span></header>']
    if lead:
        parts.append(f"<p>{html.escape(lead)}</p>")
    status = stage.get("status")
    if status == "failed":
        error = stage.get("error")
        parts.append(f'<p class="notice">This stage failed{f": {html.escape(str(error))}" if error else "."}</p>')
    elif log is None:
        parts.append('<p class="notice">This stage has no log: it did not run, or did not end.</p>')
    if log is not None:
        drawn = draw(log)
        for shown in drawn:
            figures += 1
            parts.append(shown.html(figures))
        if not drawn and name in _CHAPTERS:
            parts.append('<p class="notice">The log of this stage holds nothing to draw.</p>')
        parts += [metrics_table(log.metrics), settings_table(log.settings)]
    parts.append("</section>")
    return "".join(parts), figures
