"""The tries that are kept: one file each, a recording as ``capture=file`` reads it, with what is known in its head."""

from __future__ import annotations

import dataclasses
import os
import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kendama_cli.errors import UsageError
from kendama_cli.schema.arrays import Array

COLUMNS = ("t_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "ball_x_m", "ball_y_m", "ball_z_m", "pull_n")
TITLE = "# A swing that was played in the browser with 'kendama play'."
FACT = re.compile(r"# (\w+): (.*)")
LONGEST_NAME, LONGEST_NAME_BYTES = 40, 80
"""Characters and bytes of a name: player, try and what is beside them fit a file's name of 255 bytes."""
OUTCOMES = ("caught", "missed", "interrupted")
PROBE_BYTES = 1 << 20
"""More than the longest try takes."""
MOST_FACTS, LONGEST_LINE = 9, 1000
"""Lines of a head, and characters of a line, that are read."""


@dataclass(frozen=True)
class Try:
    """Facts of one try: its name, which is its file's, and the lines at the head of that file.

    ``conditions`` are in words; ``chosen`` says whether ``capture=play`` takes it, ``note`` why the try was interrupted
    or why a caught one cannot be chosen.
    """

    name: str
    outcome: str
    chosen: bool
    began: str
    duration_s: float
    conditions: str
    note: str = ""


def plain_name(text: str) -> str:
    """Return ``text`` as a name of files: small letters and digits of any script, joined by hyphens.

    Marks over Latin letters are dropped. Raises UsageError where no letter or digit is left.
    """
    apart = unicodedata.normalize("NFKD", text.casefold())
    bare = unicodedata.normalize("NFC", re.sub(r"(?<=[a-z])[\u0300-\u036f]+", "", apart))
    letters = "".join(one if unicodedata.category(one)[0] in "LNM" else "-" for one in bare)
    name = re.sub(r"-+", "-", letters)[:LONGEST_NAME].encode()[:LONGEST_NAME_BYTES].decode(errors="ignore").strip("-")
    if not any(map(str.isalnum, name)):
        raise UsageError(f"the name {text[:LONGEST_NAME]!r} has no letter or digit; use some, of any script")
    return name


def check_folder(folder: Path) -> None:
    """Raise UsageError where a try could not be written below ``folder``, which is made where it is not there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".probe.{os.getpid()}"
        try:
            _write_whole(probe, bytes(PROBE_BYTES))
        finally:
            probe.unlink(missing_ok=True)
    except OSError as error:
        raise UsageError(
            f"tries cannot be kept in {folder}: {error.strerror or error}; make it writable, or set play.folder"
        ) from None


class TryFolder:
    """The tries of one player below ``folder``; files that are no tries are left alone.

    ``doubt`` says why ``capture=play`` does not take a file, None where it does.
    """

    def __init__(self, folder: Path, player: str, most: int, doubt: Callable[[Path], str | None]) -> None:
        """Raise UsageError for a player without a letter or digit."""
        self.player = plain_name(player)
        self.path = folder / self.player
        self._most, self._doubt = most, doubt

    def check(self) -> None:
        """Raise UsageError where the next try could not be kept."""
        if self.path.exists():
            check_folder(self.path)
            self._check_room(len(list(self.path.glob("*.csv"))))

    def tries(self) -> list[Try]:
        """Return all tries, the oldest first."""
        found = [read_try(file) for file in self.path.glob("*.csv")]
        return sorted((one for one in found if one is not None), key=lambda one: (one.began, one.name))

    def keep(self, new: Try, samples: Array) -> Try:
        """Write a new try of ``samples`` (n, columns) under the next number, marked where caught and taken.

        Raises UsageError where the folder holds as many as it may.
        """
        names = {file.stem for file in self.path.glob("*.csv")}
        self._check_room(len(names))
        number = 1 + max((int(found[1]) for name in names if (found := re.search(r"-(\d{1,9})$", name))), default=0)
        made = dataclasses.replace(new, name=f"{self.player}-{number:03d}")
        self.path.mkdir(parents=True, exist_ok=True)
        self._write(made, rows_of(samples))
        if made.outcome == "caught":
            doubt = self._doubt(self._file(made.name))
            note = "" if doubt is None else f"not for the robot: {doubt}"
            made = dataclasses.replace(made, chosen=doubt is None, note=note)
            self._write(made, rows_of(samples))
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
        """Say whether ``capture=play`` takes it; raises UsageError with the reason where it could not."""
        file = self._file(name)
        kept, doubt = read_try(file), self._doubt(file) if chosen else None
        assert kept is not None
        if doubt is not None:
            raise UsageError(f"'{name}' is not for the robot: {doubt}")
        self._write(dataclasses.replace(kept, chosen=chosen), "".join(_rows(file)))

    def delete(self, name: str) -> None:
        """Delete it; raises UsageError where there is none of this name."""
        self._file(name).unlink()

    def samples(self, name: str) -> Array:
        """Read the samples (n, columns) of a try; raises UsageError if it is missing or cannot be read."""
        try:
            samples = np.loadtxt(_rows(self._file(name))[1:], delimiter=",", ndmin=2)
            if samples.shape[1:] == (len(COLUMNS),) and len(samples) > 0:
                return samples
        except ValueError:
            pass
        raise UsageError(f"the file of try '{name}' has been changed and cannot be shown")

    def _check_room(self, tries: int) -> None:
        if tries >= self._most:
            raise UsageError(f"{self.path} holds {tries} tries, as many as it may: delete some to keep more")

    def _file(self, name: str) -> Path:
        """Find the file of a try by its name in the folder's list: no path is made of what a page says."""
        for file in self.path.glob("*.csv"):
            if file.stem == name and read_try(file) is not None:
                return file
        raise UsageError(f"there is no try '{name[:LONGEST_NAME]}' of {self.player}: it may have been deleted")

    def _write(self, one: Try, rows: str) -> None:
        """Write under a name of its own first: a file of a try is whole or is not there."""
        partial = self.path / f".{one.name}.{os.getpid()}"
        try:
            _write_whole(partial, (head(one) + rows).encode())
            partial.replace(self.path / f"{one.name}.csv")
        except OSError:
            partial.unlink(missing_ok=True)
            raise


def head(one: Try) -> str:
    """Return the lines before a try's header row."""
    facts = {
        "origin": "person",
        "outcome": one.outcome,
        "chosen": "yes" if one.chosen else "no",
        "began": one.began,
        "duration_s": one.duration_s,
        "conditions": one.conditions,
        **({"note": " ".join(one.note.split())} if one.note else {}),
    }
    return "\n".join([TITLE, *(f"# {name}: {value}" for name, value in facts.items())]) + "\n"


def rows_of(samples: Array) -> str:
    """Return the header row and ``samples`` (n, columns) as text."""
    rows = [",".join(COLUMNS), *(",".join(f"{value:.5f}" for value in row) for row in samples.tolist())]
    return "\n".join(rows) + "\n"


def read_try(file: Path) -> Try | None:
    """Read the head of ``file``; None for a file that is no try."""
    try:
        if not file.is_file():  # a pipe would be waited for
            return None
        with file.open(encoding="utf-8", errors="replace") as stream:
            lines = [stream.readline(LONGEST_LINE).rstrip("\n") for _ in range(MOST_FACTS)]
        facts = {found[1]: found[2] for line in lines[1:] if (found := FACT.fullmatch(line))}
        if lines[0] != TITLE or facts["outcome"] not in OUTCOMES:
            return None
        duration_s = float(facts["duration_s"])
    except (OSError, KeyError, ValueError):
        return None
    known = (facts["outcome"], facts["chosen"] == "yes", facts["began"], duration_s, facts["conditions"])
    return Try(file.stem, *known, note=facts.get("note", ""))


def _rows(file: Path) -> list[str]:
    """Return the lines of a try's file below its head."""
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines(keepends=True)
    return [line for line in lines if not line.startswith("#")]


def _write_whole(file: Path, content: bytes) -> None:
    with file.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
