"""Texts of a log stand in a page as texts: whatever they are, the page has the same elements."""

from __future__ import annotations

import html.parser
import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from kendama_cli.errors import InputError
from kendama_cli.log.reader import LogFile
from kendama_cli.log.writer import STAGE_METADATA, McapLog, MemoryFile
from kendama_cli.report.page import make_report
from kendama_cli.report.page_head import data_script
from kendama_cli.report.plot import drawing
from kendama_cli.report.sweep_page import make_sweep_report
from kendama_cli.schema.declaration import find_stage, stage_names

EVIL = (
    """<meta http-equiv="refresh" content="0;url=http://evil.example/"><b id=injected>""",
    """"><svg onload=alert(1)><b id=injected>""",
    """' onmouseover='alert(1)' <b id=injected>""",
    """</script></style></title></svg><b id=injected>""",
    """]]><b id=injected><!--""",
    """\\g<0><b id=injected>""",
    """$x$<b id=injected>""",
)


class Elements(html.parser.HTMLParser):
    """Counts the elements and the names of attributes of a page, as an independent reading of it."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: Counter[str] = Counter()
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.update([tag, *(f"{tag} {name}" for name, _ in attrs)])


def log(folder: Path, stage: str, metrics: dict[str, Any], settings: dict[str, Any]) -> Path:
    folder.mkdir(exist_ok=True, parents=True)
    made = McapLog({}, MemoryFile())
    made.finish(folder / f"{stage}.mcap", stage=stage, settings=settings, metrics=metrics)
    return folder / f"{stage}.mcap"


def pages(folder: Path, text: str) -> list[str]:
    """The page of a run and that of a sweep in which every text that others may write is ``text``."""
    logs, entries = {}, []
    for stage in stage_names():
        declaration = find_stage(stage)
        assert declaration is not None
        metrics = {one.metric: text for one in declaration.headline} | {text: text, "rollouts": 1.0, f"{text}_m": 2}
        logs[stage] = log(folder, stage, metrics | {"warnings": text}, {text: text, "x": [text, {text: text}]})
        entries.append({"name": stage, "stage": stage, "status": "failed", "error": text})
    entries.append({"name": text, "stage": text, "status": "failed", "error": text})
    run = {"run": text, "pipeline": text, "overrides": [f"a={text}", text], "stages": entries}
    other = run | {"overrides": ["a=2"]}
    again = {name: log(folder / "again", name, {"rollouts": 2.0}, {}) for name in logs}
    return [make_report(run, logs), make_sweep_report(text, [(run, logs), (other, again)])]


@pytest.mark.parametrize("text", EVIL)
def test_a_page_has_no_element_that_a_text_of_a_log_brings(text: str, tmp_path: Path) -> None:
    plain, hostile = pages(tmp_path / "plain", "text"), pages(tmp_path / "hostile", text)
    for one, other in zip(plain, hostile, strict=True):
        assert "<b id=injected>" not in other
        found, known = Elements(other).found, Elements(one).found
        assert set(found) <= set(known)
        for tag in ("meta", "script", "b", "svg", "style", "section", "a href"):
            assert found[tag] == known[tag]


@pytest.mark.parametrize("text", EVIL)
def test_labels_of_a_plot_and_data_for_scripts_end_no_element(text: str) -> None:
    assert set(Elements(plot(text)).found) <= set(Elements(plot("text")).found)
    script = data_script({text: [text]})
    assert Elements(script).found == Elements("<script type='application/json'></script>").found
    assert json.loads(script.partition(">")[2].rpartition("<")[0]) == {text: [text]}


def plot(text: str) -> str:
    with drawing("plot", text) as made:
        (axes,) = made.axes()
        axes.plot([0, 1], label=text)
        axes.set_title(text)
        axes.legend()
    return made.svg


@pytest.mark.parametrize("value", [["<b>"], [["<b>"]], {"a": "<b>"}, 10**400])
def test_a_metric_that_is_no_number_text_bool_or_none_is_refused(tmp_path: Path, value: object) -> None:
    path = log(tmp_path, "encode", {"rmse_mm": value}, {})
    with pytest.raises(
        InputError, match=r"its metric 'rmse_mm' is a .*; allowed: a number, text, yes or no, or nothing"
    ):
        make_report({}, {"encode": path})


@pytest.mark.parametrize("facts", [("[]", "{}"), ("{}", "[1]"), ("{}", "[" * 100_000), ("1", "2")])
def test_settings_and_metrics_that_have_no_names_are_refused(
    tmp_path: Path, facts: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = log(tmp_path, "encode", {}, {})
    written = {STAGE_METADATA: {"stage": "encode", "settings": facts[0], "metrics": facts[1]}}
    monkeypatch.setattr(LogFile, "metadata", property(lambda _: written))
    with pytest.raises(InputError, match=r"metadata 'kendama\.stage'"):
        make_report({}, {"encode": path})
