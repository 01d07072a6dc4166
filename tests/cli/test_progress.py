"""Messages of a run while it goes on."""

from __future__ import annotations

from pathlib import Path

import pytest

from kendama_cli.cli.progress import PlainLines
from kendama_cli.cli.render import figures, summary
from kendama_cli.pipeline.record import RunRecord, StageOutcome


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
    (whole, _) = capsys.readouterr().out.splitlines()
    monkeypatch.setenv("COLUMNS", str(columns))
    summary(record, "end")
    lines = capsys.readouterr().out.splitlines()[:-1]
    assert len(lines) > 1
    assert max(map(len, lines)) <= columns
    assert " ".join(" ".join(lines).split()) == " ".join(whole.split())


def test_a_failure_is_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    record = ended("failed", "the rope is too short")
    PlainLines().stage_ends(record.stages[0])
    summary(record, "end")
    told = capsys.readouterr()
    assert (told.err + told.out).count("the rope is too short") == 1
    assert "encode    failed standard error says why" in told.out


def test_a_metric_that_says_nothing_is_a_dash() -> None:
    told = figures({"origin": "", "caught": True, "tau": 1.14321, "missing": None})
    assert told == "origin -, caught yes, tau 1.143, missing -"
