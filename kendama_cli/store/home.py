"""The folder that is a home: known by its sealed mark, else by sealed records of ours; and every name made in it.

Nothing is written into a folder of somebody else, and nothing is deleted whose name is not one of these.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from kendama_cli.errors import FormatError, StoreError, UsageError
from kendama_cli.schema.renames import SINCE
from kendama_cli.store import durable

MARK = "kendama-home.json"
"""The file by which a home is known; sealed."""
IGNORE = ".gitignore"
"""The file by which Git passes over a new home."""
NOTHING = ("lost+found", "locks", IGNORE)
"""Names beside which a folder counts as empty: a new disk's own, and what a run of 0.2 left that could not begin."""
KEY = re.compile(r"[0-9a-f]{40}")
DIGEST = re.compile(r"[0-9a-f]{64}")
STAGE = re.compile(r"[\w-]{1,250}")
RUN = re.compile(r"\d{1,18}(-\d{6})?-[0-9a-f]{6}")
UNFINISHED = re.compile(re.escape(durable.SCRATCH) + "-[0-9a-f]{32}")
_ARTIFACT = r"(artifact|metrics|manifest)\.json|arrays\.npz|log\.mcap|pack"
_ANY = r"[\s\S]*"
_S = STAGE.pattern
_MADE: dict[str, str | None] = {
    rf"results/{_S}/{KEY.pattern}\.json": None,
    rf"runs/{RUN.pattern}\.json": None,
    rf"runs/{RUN.pattern}": rf"{_S}\.(txt|mcap)|tags\.json|in_use\.lock|{UNFINISHED.pattern}",
    rf"objects/[0-9a-f]{{2}}/{DIGEST.pattern}": _ARTIFACT,
    rf"checkpoints/{_S}/{KEY.pattern}": rf"\d{{8,}}\.ckpt|log\.part|{UNFINISHED.pattern}",
    r"scratch/[0-9a-f]{32}": _ARTIFACT,
    r"scratch/[0-9a-f]{32}\.pack": None,
    r"inputs/[0-9a-f]{32}": r"[0-9a-f]{16}",
    r"slurm/[0-9a-f]{16}": _ANY,
    rf"index/(files|latest/[^/]+/{_S}|(composed?|unchanged)/[0-9a-f]{{32}})\.json": None,
    rf"(([^/]+/){{1,3}}){UNFINISHED.pattern}": _ANY,
}
"""Patterns of names below a home, and of a folder those of the names directly in it; None stands for a file."""
PLACES = ("results", "runs", "objects", "checkpoints", "scratch", "inputs", "slurm", "locks", "index")
OLD_RETURNS = "gives"
"""The part of a key that names the artifact of a stage, until 0.3."""
LOOKED_AT = 20
"""So many records of each kind are read before a folder is called somebody else's."""


def claim(home: Path, option: str = "--home") -> None:
    """Make ``home`` where there is nothing, and mark it where it is ours already; ``option`` is what names it.

    Raises UsageError where it is a folder of somebody else, StoreError where a new one cannot be made.
    """
    if durable.read_sealed(home / MARK) is not None:
        return
    names = [one for one in durable.listed(home) if not UNFINISHED.fullmatch(one.name) and one.name not in NOTHING]
    if not names:
        _mark(home)
        with contextlib.suppress(StoreError):
            durable.write_file(home / IGNORE, b"# made by kendama: results are made again, not versioned\n*\n")
    elif _has_records(home):
        with contextlib.suppress(StoreError):  # another user's, or a full disk: the records speak for it as well
            _mark(home)
    elif durable.read_sealed(home / MARK) is None:  # else another process has marked it meanwhile
        raise UsageError(
            f"{home} holds files and is no home of kendama ({names[0].name}, ...): nothing there is written or "
            f"deleted; name an empty or a new folder with {option}"
        )


def home_above(home: Path) -> Path | None:
    """Return the nearest home of the same name in a folder above that of ``home``; None where there is none."""
    above = (folder / home.name for folder in home.absolute().parent.parents)
    return next((one for one in above if (one / MARK).is_file()), None)


def above_notice(home: Path) -> str:
    """Return a clause that names a home above ``home``; empty where there is none."""
    above = home_above(home)
    return "" if above is None else f"; a folder above has one: --home {above}"


def is_made_here(home: Path, path: Path) -> bool:
    """Return True if ``path`` is a name that kendama makes in ``home``, is no link and reached through none.

    JSON that was never sealed is a person's, whatever its name, but in the index, which a run would write over.
    """
    inside = path.relative_to(home)
    if path.is_symlink() or path.parent.resolve() != home.resolve() / inside.parent:
        return False
    for pattern, held in _MADE.items():
        if re.fullmatch(pattern, inside.as_posix()):
            if not path.is_dir():
                return (held is None or held is _ANY) and (inside.parts[0] == "index" or not _is_plain_json(path))
            return held is not None and all(re.fullmatch(held, one.name) for one in durable.listed(path))
    return False


def _is_plain_json(path: Path) -> bool:
    """Return True if ``path`` is whole JSON that was never sealed, which no damage makes of a record of ours."""
    try:
        value = json.loads(durable.read_file(path) or b"")
    except (ValueError, RecursionError):
        return False
    return not isinstance(value, dict) or "seal" not in value


def _mark(home: Path) -> None:
    durable.make_folder(home)
    names = {} if _has_old_names(home) else {"names": SINCE}
    durable.write_sealed(home / MARK, {"home": "kendama", **names})


def check_names(home: Path) -> None:
    """Raise UsageError where what ``home`` holds was written by a version with other names of settings."""
    mark = durable.read_sealed(home / MARK)
    if mark.get("names") != SINCE if mark is not None else _has_old_names(home):
        raise UsageError(
            f"{home} has the names of settings and metrics from before {SINCE}; type 'kendama cache migrate' once, "
            "which keeps every recording and run"
        )


def _has_old_names(home: Path) -> bool:
    """Return True if a key of the first results in ``home`` has the parts of 0.2, which did not mark its homes."""
    for path in itertools.islice(home.glob("results/*/*.json"), LOOKED_AT):
        with contextlib.suppress(FormatError):
            if OLD_RETURNS in (durable.read_sealed(path) or {}).get("parts", {}):
                return True
    return False


def _has_records(home: Path) -> bool:
    """Return True if one of the first records in ``home`` is whole, of whatever format."""
    for pattern in ("runs/*.json", "runs/*/run.json", "results/*/*.json"):
        for path in itertools.islice(home.glob(pattern), LOOKED_AT):
            try:
                if durable.read_sealed(path) is not None:
                    return True
            except FormatError:
                return True
    return any(durable.read_index(path) is not None for path in itertools.islice(_index_files(home), LOOKED_AT))


def _index_files(home: Path) -> Iterator[Path]:
    return home.glob("index/**/*.json")


_RECORD = ".json"
_BEFORE = "run.json"
"""A run's record stood in its folder under this name until 0.2."""


def record_path(home: Path, run: str) -> Path:
    """Return the file of a run's record."""
    return home / "runs" / f"{run}{_RECORD}"


def run_folder(home: Path, run: str) -> Path:
    """Return the folder beside a run's record; absent if the run has no files."""
    return home / "runs" / run


def run_number(run: str) -> int:
    """Return the number at the start of a run's name, by which runs are ordered."""
    digits = run.partition("-")[0]
    return int(digits) if digits.isascii() and digits.isdecimal() else 0


def run_names(home: Path) -> list[str]:
    """Return the runs that have a record or a folder, oldest first.

    Raises StoreError where that cannot be read now, FormatError where a record stands inside a folder, as until 0.2,
    and UsageError where the records have the names of an older version.
    """
    check_names(home)
    names = [name for name in durable.names(home / "runs") if RUN.fullmatch(name.removesuffix(_RECORD))]
    recorded = {name.removesuffix(_RECORD) for name in names if name.endswith(_RECORD)}
    others = {name for name in names if not name.endswith(_RECORD)} - recorded
    for run in others:
        if durable.exists(run_folder(home, run) / _BEFORE):
            location = str(run_folder(home, run) / _BEFORE)
            raise FormatError(location, "the record of a run", "runs/RUN/run.json", "runs/RUN.json")
    return sorted(recorded | others, key=lambda run: (run_number(run), run))


def read_latest(home: Path, pipeline: str, stage: str) -> Any:
    """Return the ``key`` and ``parts`` that were stored last; None if there are none."""
    return durable.read_index(_path(home, pipeline, stage))


def keep_latest(home: Path, pipeline: str, stage: str, key: str | None, parts: Mapping[str, Any]) -> None:
    """Make ``key`` the one that the next plan compares with."""
    record = {"key": key, "parts": parts}
    path = _path(home, pipeline, stage)
    if durable.read_index(path) != record:
        durable.write_index(path, record)


def _path(home: Path, pipeline: str, stage: str) -> Path:
    return home / "index" / "latest" / pipeline / f"{stage}.json"
