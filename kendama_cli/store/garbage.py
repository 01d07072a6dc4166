"""Deletion of the parts of a home that are damaged or unused, found by reading every byte.

Only what every one of three readings found damaged is deleted. A file that cannot be read now (a failing disk, a
permission, too many open files) is not a damaged one: there the collection stops with one line and has deleted nothing.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from kendama_cli.store import durable
from kendama_cli.store.home import DIGEST, KEY, MARK, PLACES, STAGE, UNFINISHED, is_made_here, record_path, run_names
from kendama_cli.store.store import MANIFEST, Store, damaged_files, read_manifest
from kendama_cli.system.interface import system

T = TypeVar("T")
READINGS = 3
"""So often is something read before it counts as damaged."""
MEANWHILE = ("scratch", "inputs", "slurm")
"""Folders of what is needed while a run or a sweep goes on alone: unpublished work, copies of others' input files, and
what the jobs of a cluster were given and printed."""


@dataclass(frozen=True)
class Damage:
    """One thing in the store that is not as it was written."""

    path: Path
    problem: str


def verify(store: Store) -> list[Damage]:
    """Read every byte of the store; what is damaged or missing. Raises StoreError where something cannot be read."""
    damage = [found for path in store.result_files() for found in _damaged_result(store, path)]
    damage += [found for folder in _objects(store) for found in _damaged_object(folder)]
    damage += [
        Damage(path, "the run's record is not as it was written")
        for path in _records(store)
        # a run that could not begin, on a full disk say, has left a folder without a record
        if durable.exists(path) and durable.read_sealed(path) is None
    ]
    damage += [found for path in _records(store) for found in _damaged_prints(path)]
    damage += [found for folder in _checkpoints(store) for found in _damaged_checkpoints(folder)]
    if durable.exists(store.home / MARK) and durable.read_sealed(store.home / MARK) is None:
        damage.append(Damage(store.home / MARK, "the home's mark is not as it was written; it is written anew"))
    damage += [
        Damage(path, "the index's bytes are not those written; what it says is found out anew")
        for path in _index_files(store.home / "index")
        if durable.read_index(path) is None
    ]
    return damage


@dataclass(frozen=True)
class Collection:
    """The names that were deleted, and those that were left because something in them is not ours; both sorted."""

    deleted: list[Path]
    left: list[Path]


def collect_garbage(store: Store, keep_runs: int | None = None, *, dry_run: bool = False) -> Collection:
    """Delete what is damaged, what no result names, and what killed processes left.

    With ``keep_runs``, runs but the newest so many are forgotten too, with all that only they used. Checkpoints of
    unfinished work are kept: a rerun resumes from them. Only names that kendama makes are deleted, never
    through a link; a folder with anything else in it is left. With ``dry_run`` nothing is. Raises UsageError where the
    home is none, StoreError while a run goes on, and where something cannot be read now: nothing has been deleted then.
    """
    with store.alone():
        results = store.result_files()
        intact = {path: store.find(path.parent.name, path.stem) for path in results}
        damaged = [path for path, result in intact.items() if result is None]
        lost = [path for path in _records(store) if durable.read_sealed(path) is None]
        _drop_cached([*damaged, *lost, *_artifact_files(store, damaged)])
        again = {path: _reread(functools.partial(store.find, path.parent.name, path.stem)) for path in damaged}
        gone = [path for path, result in again.items() if result is None]
        gone += [
            path
            for record in lost
            if _reread(functools.partial(durable.read_sealed, record)) is None
            for path in _of_run(record)
        ]
        if keep_runs is not None:
            gone += _forgotten(store, keep_runs, results)
        kept = {path: result for path, result in {**intact, **again}.items() if path not in gone and result is not None}
        named = {result.artifact for result in kept.values()}
        gone += [folder for folder in _objects(store) if folder not in named]
        gone += [
            folder
            for folder in _checkpoints(store)
            if store.result_path(folder.parent.name, folder.name) in kept
            or not any(path.suffix == ".ckpt" for path in durable.listed(folder))
        ]
        gone += [path for path in _index_files(store.home / "index") if durable.read_index(path) is None]
        gone += [
            path for name in MEANWHILE for path in durable.listed(store.home / name) if is_made_here(store.home, path)
        ]
        gone += _unfinished(store.home)
        ours = [path for path in dict.fromkeys(gone) if is_made_here(store.home, path)]
        if not dry_run:
            for path in ours:  # results go before the artifacts that they name
                durable.remove(path)
            _drop_locks(store.home / "locks")
    return Collection(sorted(ours), sorted(set(gone) - set(ours)))


def _objects(store: Store) -> Iterator[Path]:
    for beginning in durable.listed(store.objects):
        if len(beginning.name) == 2:
            yield from (path for path in durable.listed(beginning) if DIGEST.fullmatch(path.name))


def _records(store: Store) -> list[Path]:
    """Return where the records of runs are or, of a run that left a folder alone, would be; oldest first."""
    return [record_path(store.home, run) for run in run_names(store.home)]


def _of_run(record: Path) -> list[Path]:
    """Return the paths of a run: its record, and the folder beside it."""
    return [path for path in (record, record.with_suffix("")) if durable.exists(path)]


def _checkpoints(store: Store) -> Iterator[Path]:
    for stage in durable.listed(store.checkpoints):
        if STAGE.fullmatch(stage.name):
            yield from (path for path in durable.listed(stage) if KEY.fullmatch(path.name))


def _index_files(folder: Path) -> Iterator[Path]:
    for path in durable.listed(folder):
        if path.suffix == ".json":
            yield path
        elif not path.name.startswith(durable.SCRATCH):
            yield from _index_files(path)


def _unfinished(folder: Path, depth: int = 3) -> Iterator[Path]:
    """Yield everything in the folders of a home that a killed process had not finished.

    Not what stands in the home itself: who marks it has no lock yet.
    """
    for path in durable.listed(folder):
        if depth < 3 and UNFINISHED.fullmatch(path.name):
            yield path
        elif depth and (depth < 3 or path.name in PLACES) and path.is_dir() and not path.is_symlink():
            yield from _unfinished(path, depth - 1)


def _drop_locks(folder: Path) -> None:
    """Delete the locks of keys, made until 0.2 and by killed runs, that no worker which outlived its run holds."""
    for path in durable.listed(folder):
        if KEY.fullmatch(path.stem[-40:]) and path.suffix == ".lock" and not path.is_symlink():
            with durable.plain_disk_errors(path):
                lock = system().try_lock(path)
                if lock is not None:
                    lock.release()


def _damaged_prints(path: Path) -> Iterator[Damage]:
    """Yield damaged output of the workers of a run whose digest stands in the run's record ``path``."""
    record, folder = durable.read_sealed(path) or {}, path.with_suffix("")
    for name, digest in record.get("printed", {}).items():
        if Path(name).name != name:
            continue  # not a file of the run
        data = durable.read_file(folder / name)
        if data is None or durable.sha256(data) != digest:
            yield Damage(folder / name, "is missing" if data is None else "the bytes are not those written")


def _damaged_checkpoints(folder: Path) -> Iterator[Damage]:
    from kendama_cli.log.container_writer import is_whole  # noqa: PLC0415 - with mcap and numpy, for this alone
    from kendama_cli.store.checkpoint import LOG_PART, checkpoint_files, read_checkpoint  # noqa: PLC0415

    damaged_log = False
    for path in checkpoint_files(folder):
        found = read_checkpoint(path)
        if found is None:
            yield Damage(path, "the checkpoint's bytes are not those written")
        elif not is_whole(found.log, folder / LOG_PART):
            damaged_log = True
    if damaged_log:
        yield Damage(folder / LOG_PART, "the log that a checkpoint counts on is not as it was written")


def _damaged_result(store: Store, path: Path) -> Iterator[Damage]:
    record = durable.read_sealed(path)
    if record is None:
        yield Damage(path, "the result's bytes are not those written")
    elif not durable.exists(store.object_folder(str(record["artifact"]))):
        yield Damage(path, f"its artifact {str(record['artifact'])[:12]} is missing")


def _damaged_object(folder: Path) -> Iterator[Damage]:
    manifest = read_manifest(folder)
    if manifest is None:
        yield Damage(folder / MANIFEST, "the manifest is missing or its bytes are not those written")
    else:
        yield from (Damage(folder / name, problem) for name, problem in damaged_files(folder, manifest))


def _reread(read: Callable[[], T | None]) -> T | None:
    """Return the result of the second or the third reading if it is intact."""
    return next((found for found in (read() for _ in range(READINGS - 1)) if found is not None), None)


def _artifact_files(store: Store, results: list[Path]) -> list[Path]:
    records = [record for record in map(durable.read_sealed, results) if record is not None]
    return [path for record in records for path in durable.listed(store.object_folder(str(record["artifact"])))]


def _forgotten(store: Store, keep: int, results: list[Path]) -> list[Path]:
    """Return the paths of all but the newest ``keep`` runs, and of results that no other run used."""
    paths = _records(store)
    newest = paths[max(0, len(paths) - keep) :]
    records = [durable.read_sealed(path) or {"stages": []} for path in newest]
    used = {(stage["name"], stage["key"]) for record in records for stage in record["stages"]}
    unused = [path for path in results if (path.parent.name, path.stem) not in used]
    forgotten = paths[: len(paths) - len(newest)]
    return [*(path for record in forgotten for path in _of_run(record)), *unused]


def _drop_cached(paths: list[Path]) -> None:
    """Make the next reading come from the disk itself, if the system supports that."""
    if not hasattr(os, "posix_fadvise"):
        return
    for path in paths:
        try:
            handle = os.open(path, os.O_RDONLY)
        except OSError:
            continue
        try:
            os.posix_fadvise(handle, 0, 0, os.POSIX_FADV_DONTNEED)
        except OSError:
            continue
        finally:
            os.close(handle)
