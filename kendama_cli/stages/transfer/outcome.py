"""Outcomes of rollouts in words: asked at the prompt, or read from a file to which any program appends."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

from kendama_cli.adaptation.aim_words import ALLOWED, Outcome, read_outcome
from kendama_cli.errors import StageError
from kendama_cli.stages.interface import StageContext

MEASURED, ASK = "measured", "ask"
POLL_S = 0.2
AGAIN_S, SELDOM_S = 6.0, 60.0
"""Waiting is told at once, once more soon after, as a view may leave out what follows too closely, then seldom."""


class ToldOutcomes:
    """Outcomes that ``source`` tells, ASK or the path of a file; a line of the file counts from a rollout's start on.

    Raises StageError, before anything moves, where there is nobody to ask, or no such file.
    """

    def __init__(self, source: str, ctx: StageContext) -> None:
        self._path = None if source == ASK else Path(source)
        self._ctx = ctx
        if self._path is None:
            self._ask("After each rollout, hang the ball at rest before you answer. Press Enter to begin")
        elif not self._path.is_file():
            raise StageError(
                f"transfer.outcome is '{source}', and there is no such file; make it empty, or use {MEASURED} or {ASK};"
                " nothing was moved"
            )

    def mark(self) -> int:
        """Return from which byte of the file the coming rollout's outcome stands."""
        return 0 if self._path is None else self._path.stat().st_size

    def wait(self, number: int, since: int) -> Outcome:
        """Return the outcome of rollout ``number`` as soon as it is told; a file tells it from byte ``since`` on."""
        if self._path is not None:
            return self._read(self._path, number, since)
        complaint = ""
        while True:
            answer = self._ask(f"{complaint}Outcome of rollout {number} ({ALLOWED})")
            outcome = read_outcome(answer)
            if outcome is not None:
                return outcome
            complaint = f"'{answer}' is no outcome. "

    def _ask(self, question: str) -> str:
        answer = self._ctx.ask(question)
        if answer is None:
            raise StageError(
                "transfer.outcome=ask finds no terminal to ask at; use transfer.outcome=FILE, and append to that file a"
                " line with the outcome after each rollout"
            )
        return answer

    def _read(self, path: Path, number: int, since: int) -> Outcome:
        seen, complaint, due_s, pause_s = 0, "", 0.0, AGAIN_S
        while True:
            lines = list(_whole_lines(path, since))
            for line in lines[seen:]:
                outcome = read_outcome(line)
                if outcome is not None:
                    return outcome
                complaint, due_s, pause_s = f"'{line[:40]}' is no outcome ({ALLOWED}); ", 0.0, AGAIN_S
            seen = len(lines)
            if time.monotonic() >= due_s:
                self._ctx.progress(number, None, outcome=f"{complaint}waits for a line in {path}")
                due_s, pause_s = time.monotonic() + pause_s, SELDOM_S
            time.sleep(POLL_S)


def _whole_lines(path: Path, since: int) -> Iterator[str]:
    """Yield the lines of ``path`` that end, from byte ``since`` on, without those that are empty."""
    *lines, _ = path.read_bytes()[since:].split(b"\n")
    for line in lines:
        if text := line.decode(errors="replace").strip():
            yield text
