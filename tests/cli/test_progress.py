"""Messages of a run while it goes on."""

from __future__ import annotations

import dataclasses
import io
import string
import sys
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from rich.text import Text

from kendama_cli.cli.progress import LiveView, PlainLines, briefly
from kendama_cli.cli.render import change, figures, summary
from kendama_cli.pipeline.record import RunRecord, StageOutcome
from kendama_cli.schema.declaration import find_stage, stage_names


def test_a_stage_that_starts_tells_its_first_reasons_and_how_many_more(capsys: pytest.CaptureFixture[str]) -> None:
    lines = PlainLines()
    lines.stage_starts("adapt", None, ("config a 1 -> 2",))
    lines.stage_starts("learn", None, tuple(f"config {key} 1 -> 2" for key in "abcde"))
    lines.stage_starts("transfer", None, ())
    one, many, none = capsys.readouterr().err.splitlines()
    assert one == "adapt: starts (config a 1 -> 2)"
    assert many.endswith("(config a 1 -> 2; config b 1 -> 2; config c 1 -> 2; 2 more in 'kendama plan')")
    assert none == "transfer: starts (goes on)"


def test_a_stage_that_runs_for_the_first_time_is_starting(capsys: pytest.CaptureFixture[str]) -> None:
    PlainLines().stage_starts("adapt", "key", ("never ran",))
    assert capsys.readouterr().err == "adapt: starting\n"


def ended(status: str, error: str | None = None, **metrics: float) -> RunRecord:
    stage = StageOutcome("encode", "encode", "key", status, 1.0, None, metrics, error)
    return RunRecord(Path(), "00001-a", "kendama", [], "", outcome="done", stages=[stage], versions={})


@pytest.mark.parametrize("columns", [40, 80])
def test_a_closing_line_breaks_between_words_alone(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, columns: int
) -> None:
    record = ended("ran", **{f"position_error_mm_p{i}": 0.1234 * i for i in range(1, 7)})
    monkeypatch.delenv("COLUMNS", raising=False)
    summary(record, "end")
    whole, results, _ = capsys.readouterr().out.splitlines()
    assert results == "results          in ."
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    summary(record, "end")
    lines = capsys.readouterr().out.splitlines()[:-2]
    assert len(lines) > 1
    assert max(map(len, lines)) <= columns
    assert " ".join(" ".join(lines).split()) == " ".join(whole.split())


def test_a_result_is_told_in_the_words_of_its_declaration_where_it_has_their_metrics() -> None:
    def told(stage: str, **metrics: Any) -> str:
        return briefly(StageOutcome(stage, stage, "key", "ran", 1.0, None, metrics, None))

    repeated = {"success_rate": 1.0, "repeats": 10, "success_rate_low": 0.631}
    assert told("adapt", **repeated, tau_scale=1.1432) == "100% of 10 caught (≥ 0.63), tau 1.14"
    assert told("adapt", success_rate=None, tau_scale=1.1432, a=1) == "success_rate -, tau_scale 1.143"
    assert told("strangers", a=1, b=2, c=3) == "a 1, b 2"


def test_a_count_of_one_has_no_plural() -> None:
    def brief(n: int) -> str:
        outcome = {"n_demonstrations": n, "duration_s": 2.6}
        return briefly(StageOutcome("capture", "capture", "key", "ran", 1.0, None, outcome, None))

    assert [brief(1), brief(12)] == ["1 swing of 2.6 s", "12 swings of 2.6 s"]


def test_every_stage_has_few_words_for_its_result() -> None:
    for one in map(find_stage, stage_names()):
        assert one is not None
        fields = {name for _, name, _, _ in string.Formatter().parse(one.brief) if name}
        assert fields <= set(one.metrics), one.name
        assert fields or "toy" in one.name


def test_a_run_that_found_something_for_later_runs_says_how_they_take_it(capsys: pytest.CaptureFixture[str]) -> None:
    record = ended("ran", servo="lags 0.1 s")
    record.stages[0] = dataclasses.replace(record.stages[0], name="on_arm", stage="transfer")
    summary(record, "end")
    line = "the arm lags 0.1 s; a later run leads by that from its first rollout on with transfer.servo=00001-a/on_arm"
    assert f"on_arm    again  {line}" in capsys.readouterr().out.splitlines()
    record.stages[0].metrics.clear()
    summary(record, "end")
    assert "again" not in capsys.readouterr().out


def test_the_live_view_has_a_line_a_stage_in_the_order_of_the_pipeline(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    view = LiveView(["capture", "encode"])
    view._console = view._progress.live.console = Console(width=80, file=io.StringIO(), force_terminal=True)
    view.stage_starts("encode", "key", ())
    view.stage_starts("capture", "key", ())
    view.stage_progress("encode", 3, 12, {f"figure_{i}": 0.5 for i in range(9)})
    with view._console.capture() as shown:
        view._console.print(view._progress.get_renderable())
    lines = [line for line in Text.from_ansi(shown.get()).plain.splitlines() if line.strip()]
    assert [line.split()[1] for line in lines] == ["capture", "encode"]
    assert max(map(len, lines)) <= 80


def test_a_failure_is_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    record = ended("failed", "the rope is too short")
    PlainLines().stage_ends(record.stages[0])
    summary(record, "end")
    told = capsys.readouterr()
    assert (told.err + told.out).count("the rope is too short") == 1
    assert "encode    failed standard error says why" in told.out


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        (0.2, 0.20001, "0.2 -> 0.20001"),
        (0.2, 0.3, "0.2 -> 0.3"),
        (1.0, 1.0000000001, "1 -> 1.0000000001"),
        (None, 2, "- -> 2"),
        ("", "a", "- -> a"),
        (True, False, "yes -> no"),
        (float("nan"), float("nan"), "nan -> nan"),
    ],
)
def test_a_change_has_as_many_digits_as_tell_it(before: object, after: object, told: str) -> None:
    assert change(before, after) == told


def test_a_metric_that_says_nothing_is_a_dash() -> None:
    told = figures({"origin": "", "caught": True, "tau": 1.14321, "missing": None})
    assert told == "origin -, caught yes, tau 1.143, missing -"
