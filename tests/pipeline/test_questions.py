"""Questions of a stage to the person at the terminal: from the worker through the runner to the view and back."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from kendama_cli.cli.progress import LiveView, PlainLines
from kendama_cli.pipeline.context import WorkerContext
from kendama_cli.store.checkpoint import CheckpointFolder
from kendama_cli.store.durable import write_file
from tests.toy_project import ToyProject


def context(folder: Path, emit: Callable[[Mapping[str, Any]], None], *, attended: bool) -> WorkerContext:
    return WorkerContext(seed=None, checkpoints=CheckpointFolder(folder), topics={}, emit=emit, attended=attended)


def test_the_answer_comes_back_and_without_a_person_there_is_none(tmp_path: Path) -> None:
    def answers(event: Mapping[str, Any]) -> None:
        assert (event["event"], event["question"]) == ("asks", "how was it")
        write_file(Path(event["answer"]), json.dumps("short").encode())

    assert context(tmp_path / "a", answers, attended=True).ask("how was it") == "short"
    assert context(tmp_path / "b", answers, attended=False).ask("how was it") is None


@pytest.mark.parametrize("view", [LiveView(["transfer"]), PlainLines()])
@pytest.mark.parametrize(("typed", "answer"), [("short\n", "short"), ("\n", ""), ("", None)])
def test_a_view_asks_on_standard_error_and_reads_one_line(
    view: LiveView | PlainLines,
    typed: str,
    answer: str | None,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(typed))
    with view:
        assert view.ask("how was it") == answer
    captured = capsys.readouterr()
    assert "how was it:" in captured.err
    assert not captured.out


@pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal is POSIX's")
def test_a_run_at_a_terminal_asks_and_one_without_is_told_that_there_is_none(toy: ToyProject) -> None:
    stage = toy.folder / "lib/toy/roll/stage.py"
    asking = 'answer = ctx.ask("how was it")\n        if answer != "short": raise StageError(f"heard {answer!r}")\n'
    stage.write_text(stage.read_text().replace('rng = ctx.rng("dice")', f'{asking}        rng = ctx.rng("dice")'))
    assert toy.run_json(expect=1)["stages"][0]["error"] == "heard None"
    ours, theirs = os.openpty()
    with subprocess.Popen(
        toy.command("run", "-p", "toy"), cwd=toy.folder, env=toy.environment(), stdin=theirs, stderr=subprocess.PIPE
    ) as process:
        os.close(theirs)
        os.write(ours, b"short\n")
        _, said = process.communicate(timeout=120)
    os.close(ours)
    assert process.returncode == 0, said
    assert b"how was it:" in said
