"""The tries that are kept: one file each, a recording as ``capture=file`` reads it, with what is known in its head."""

from __future__ import annotations

import dataclasses
import datetime
import os
import re
import unicodedata
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kendama_cli.errors import UsageError
from kendama_cli.schema.arrays import Array

COLUMNS = ("t_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "ball_x_m", "ball_y_m", "ball_z_m", "pull_n")
TITLE = "# A swing that was played in the browser with 'kendama play'."
FACT = re.compile(r"# (\w+): (.*)")
LONGEST_NAME = 40
PLAIN = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
OUTCOMES = ("caught", "missed", "interrupted")


@dataclass(frozen=True)
class Try:
    """What is known of one try: its name, which is its file's, and the lines at the head of that file.

    ``conditions`` are in words; ``chosen`` says whether ``capture=play`` takes it.
    """

    name: str
    outcome: str
    chosen: bool
    began: str
    duration_s: float
    conditions: str


def plain_name(text: str) -> str:
    """``text`` as a name of files: small letters, digits and hyphens; raises UsageError where nothing is left."""
    letters = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode().lower()
    name = re.sub(r"[^a-z0-9]+", "-", letters).strip("-")[:LONGEST_NAME].strip("-")
    if not name:
        raise UsageError(f"the name {text[:LONGEST_NAME]!r} has no letter or digit; use some of a to z, 0 to 9")
    return name


class TryFolder:
    """The tries of one player below ``folder``; files that are no tries are left alone."""

    def __init__(self, folder: Path, player: str, most: int) -> None:
        """Raises UsageError for a player without a letter or digit."""
        self.player = plain_name(player)
        self.path = folder / self.player
        self._most = most

    def tries(self) -> list[Try]:
        """All of them, the oldest first."""
        found = [read_try(file) for file in self.path.glob("*.csv")]
        return sorted((one for one in found if one is not None), key=lambda one: (one.began, one.name))

    def keep(self, outcome: str, conditions: str, samples: Array, now: datetime.datetime) -> Try:
        """Write a new try of ``samples`` (n, columns); raises UsageError where the folder holds as many as it may."""
        names = {file.stem for file in self.path.glob("*.csv")}
        if len(names) >= self._most:
            raise UsageError(f"{self.path} holds {len(names)} tries, as many as it may: delete some to keep more")
        number = 1 + max((int(name.rpartition("-")[2]) for name in names if re.search(r"-\d+$", name)), default=0)
        began = now.isoformat(timespec="milliseconds")
        duration_s = round(float(samples[-1, 0]), 3)
        made = Try(f"{self.player}-{number:03d}", outcome, outcome == "caught", began, duration_s, conditions)
        rows = [",".join(COLUMNS), *(",".join(f"{value:.5f}" for value in row) for row in samples.tolist())]
        self._write(made, "\n".join(rows) + "\n")
        return made

    def rename(self, name: str, wanted: str) -> str:
        """Give a try another name and say which; raises UsageError where that is taken."""
        file, plain = self._file(name), plain_name(wanted)
        new = plain if plain.startswith(f"{self.player}-") else f"{self.player}-{plain}"
        if new != name:
            if (self.path / f"{new}.csv").exists():
                raise UsageError(f"there is a try '{new}' already; choose another name")
            file.rename(self.path / f"{new}.csv")
        return new

    def choose(self, name: str, *, chosen: bool) -> None:
        """Say whether ``capture=play`` takes it."""
        file = self._file(name)
        kept = read_try(file)
        assert kept is not None
        rows = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
        self._write(dataclasses.replace(kept, chosen=chosen), "\n".join(rows) + "\n")

    def delete(self, name: str) -> None:
        """Delete it; raises UsageError where there is none of this name."""
        self._file(name).unlink()

    def samples(self, name: str) -> Array:
        """The samples (n, columns) of a try; raises UsageError where there is none, or where it cannot be read."""
        try:
            samples = np.loadtxt(self._file(name), delimiter=",", skiprows=HEAD_LINES, ndmin=2)
        except ValueError:
            raise UsageError(f"the file of try '{name}' has been changed and cannot be shown") from None
        return samples

    def _file(self, name: str) -> Path:
        file = self.path / f"{name}.csv"
        if not PLAIN.fullmatch(name) or not file.is_file() or read_try(file) is None:
            raise UsageError(f"there is no try '{name[:LONGEST_NAME]}' of {self.player}: it may have been deleted")
        return file

    def _write(self, one: Try, rows: str) -> None:
        """Under a name of its own first: a file of a try is whole or is not there."""
        self.path.mkdir(parents=True, exist_ok=True)
        partial = self.path / f".{one.name}.{os.getpid()}"
        with partial.open("w", encoding="utf-8") as stream:
            stream.write(head(one) + rows)
            stream.flush()
            os.fsync(stream.fileno())
        partial.replace(self.path / f"{one.name}.csv")


def head(one: Try) -> str:
    """The lines before a try's header row."""
    facts = {
        "outcome": one.outcome,
        "chosen": "yes" if one.chosen else "no",
        "began": one.began,
        "duration_s": one.duration_s,
        "conditions": one.conditions,
    }
    return "\n".join([TITLE, *(f"# {name}: {value}" for name, value in facts.items())]) + "\n"


HEAD_LINES = 7
"""Lines before the first row of numbers: the title, five facts, the header row."""


def read_try(file: Path) -> Try | None:
    """What the head of ``file`` tells; None for a file that is no try."""
    try:
        with file.open(encoding="utf-8", errors="replace") as stream:
            lines = [stream.readline().rstrip("\n") for _ in range(HEAD_LINES - 1)]
        facts = {found[1]: found[2] for line in lines[1:] if (found := FACT.fullmatch(line))}
        if lines[0] != TITLE or facts["outcome"] not in OUTCOMES:
            return None
        duration_s = float(facts["duration_s"])
    except (OSError, KeyError, ValueError):
        return None
    chosen = facts["chosen"] == "yes"
    return Try(file.stem, facts["outcome"], chosen, facts["began"], duration_s, facts["conditions"])
