"""The pages of a run that goes on: the one that frames it, and within it the replay and the chapters by now."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from kendama_cli.errors import KendamaError
from kendama_cli.report.animation import SCRIPT
from kendama_cli.report.figure import save_script
from kendama_cli.report.page import section
from kendama_cli.report.page_head import page_head
from kendama_cli.report.replay.page_part import replay, scripts
from kendama_cli.report.replay.performance import Kind, Performance, performance
from kendama_cli.report.source import StageLog
from kendama_cli.report.tracks import last_start_s
from kendama_cli.schema.declaration import StageDeclaration
from kendama_cli.schema.foxglove import FrameTransform

_FRAMED = "<style>main{padding:0 2px}section{margin-top:0;border:0}.replay{margin:0}</style>"


@cache
def frame_page(title: str) -> str:
    """Return the page that asks for the state of the run, shows it, and frames what is drawn."""
    script = files(__package__).joinpath("watch.js").read_text(encoding="utf-8")
    style = files(__package__).joinpath("watch.css").read_text(encoding="utf-8")
    head = page_head(title, script, also="connect-src 'self'; frame-src 'self'")
    return (
        f"{head}<body><style>{style}</style><main>"
        '<h1>The run goes on</h1><p class="run"></p><p class="notice" role="alert" hidden></p>'
        '<table class="grid stages"><thead><tr><th>stage</th><th>state</th><th>so far</th><th>figures</th>'
        "<th>time</th></tr></thead><tbody></tbody></table>"
        '<p class="controls"><label><input type="checkbox" checked> Follow: show what is new as it comes</label></p>'
        '<div class="frame" data-part="replay"></div><div class="frame" data-part="chapters"></div>'
        "<footer>Served by the run itself, to this machine alone. Closing this page changes nothing about the run."
        f"</footer></main><script>{script}</script></body></html>\n"
    )


def replay_page(shown: Sequence[Performance]) -> str:
    """Return the replay of ``shown``; where the browser has no WebGL, a sentence."""
    without = '<p class="run flat">No replay in space: this browser has no WebGL.</p>'
    return _page("kendama: replay", without + replay(shown, once=True), *scripts())


def chapters_page(shown: Sequence[tuple[str, StageDeclaration, StageLog]]) -> str:
    """Return the chapters of stages by their names, drawn from what their logs have."""
    parts, figures = [], 0
    for name, declaration, log in shown:
        part, figures = section(name, declaration, {}, log, figures)
        parts.append(part)
    return _page("kendama: chapters", "".join(parts), SCRIPT, save_script())


def _page(title: str, body: str, *texts: str) -> str:
    run = "".join(f"<script>{text}</script>" for text in texts)
    return f"{page_head(title, *texts)}<body>{_FRAMED}<main>{body}</main>{run}</body></html>\n"


def last_motion(log: StageLog, label: str, kind: Kind) -> Performance | None:
    """Return the last stretch of the ball that moved last, with its cup and whatever else stands beside it."""
    topics = log.topics_under("/")
    ends = {}
    for topic in topics:
        under = topic.removesuffix("/ball")
        if under != topic and f"{under}/cup" in topics:
            balls = log.table(topic, FrameTransform)
            if len(balls):
                ends[under] = float(balls["t_s"].iloc[-1])
    if not ends:
        return None
    under = max(ends, key=lambda one: ends[one])
    scenes = [topic for topic in topics if topic.endswith("/scene") and under.startswith(topic.removesuffix("/scene"))]
    start_s = last_start_s(log.table(f"{under}/ball", FrameTransform))
    try:
        return performance(log, under, label, kind, scene=max(scenes, default=None, key=len), start_s=start_s)
    except KendamaError:  # a stage of another package, whose settings do not say how large the game is
        return None
