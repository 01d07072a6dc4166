"""Outcomes in words: asked until they are understood, or read from a file that grows."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import pytest

from kendama_cli.adaptation.aim_words import Outcome
from kendama_cli.errors import StageError
from kendama_cli.stages.transfer.outcome import ToldOutcomes
from tests.memory_context import MemoryContext


def test_a_wrong_word_is_asked_again_with_the_allowed_ones() -> None:
    ctx = MemoryContext()
    ctx.answers = ["", "shot", "little short"]
    told = ToldOutcomes("ask", ctx)
    assert told.wait(3, told.mark()) == Outcome("short", "little")
    first, *asked = ctx.questions
    assert "hang the ball" in first
    assert [one.startswith("'shot' is no outcome. ") for one in asked] == [False, True]
    assert all("Outcome of rollout 3 (caught, short, long, left or right;" in one for one in asked)


def test_without_a_terminal_the_file_is_named() -> None:
    with pytest.raises(StageError, match=r"finds no terminal.*use transfer.outcome=FILE"):
        ToldOutcomes("ask", MemoryContext())


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StageError, match="no such file; make it empty, or use measured or ask; nothing was moved"):
        ToldOutcomes(str(tmp_path / "words.txt"), MemoryContext())


class Watched(MemoryContext):
    """Context that keeps what waiting tells."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []

    def progress(self, done: int, total: int | None, **figures: float | int | str) -> None:
        self.lines.append(str(figures["outcome"]))


def test_the_first_whole_line_after_the_mark_that_is_an_outcome_counts(tmp_path: Path) -> None:
    path, ctx = tmp_path / "words.txt", Watched()
    path.write_text("caught\n")
    told = ToldOutcomes(str(path), ctx)
    since = told.mark()
    found: list[Outcome] = []
    waiting = threading.Thread(target=lambda: found.append(told.wait(1, since)), daemon=True)
    waiting.start()

    def appended(text: str, lines: int) -> None:
        with path.open("a") as file:
            file.write(text)
        deadline_s = time.monotonic() + 60.0
        while len(ctx.lines) < lines and time.monotonic() < deadline_s:
            time.sleep(0.01)

    appended("", 1)
    appended("\nshort of it\n", 2)
    assert not found
    appended("much le", 2)
    assert not found
    appended("ft\ncaught\n", 2)
    waiting.join(60.0)
    assert found == [Outcome("left", "much")]
    assert ctx.lines[0] == f"waits for a line in {path}"
    assert ctx.lines[1].startswith("'short of it' is no outcome (caught, ")
    assert told.wait(1, since) == Outcome("left", "much"), "whoever resumes reads the same"
