"""The content-addressed store: artifacts by the digest of what they hold, results by the key of what made them.

``objects/ab/abcdef.../`` is one artifact: its files and ``manifest.json``, whose SHA-256 is the folder's name.
``results/STAGE/KEY.json`` says which artifact a key gave. Both are sealed, so that any flipped byte is found.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import shutil
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kendama_cli.errors import StoreError
from kendama_cli.store import durable

MANIFEST = "manifest.json"
NOUN = ("artifact.json", "arrays.npz")
"""The files that later stages read; log and metrics do not enter their keys."""


@dataclass(frozen=True)
class StoredResult:
    """What a key gave: the artifact's folder and digests, its metrics, and what the key was made of."""

    stage: str
    key: str
    artifact: Path
    content_digest: str
    metrics: dict[str, Any]
    parts: dict[str, Any]


@dataclass(frozen=True)
class Damage:
    """One thing in the store that is not as it was written."""

    path: Path
    problem: str


class Store:
    """The store in one home folder; every method is safe beside other processes on the same home."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.objects = home / "objects"
        self.results = home / "results"
        self.checkpoints = home / "checkpoints"
        self.scratch = home / "scratch"

    def result_path(self, stage: str, key: str) -> Path:
        """Where the result of ``key`` stands or would stand."""
        return self.results / stage / f"{key}.json"

    def checkpoint_folder(self, stage: str, key: str) -> Path:
        """Where the unfinished work of ``key`` is kept."""
        return self.checkpoints / stage / key

    def find(self, stage: str, key: str) -> StoredResult | None:
        """The intact result of ``key``; None where there is none or anything of it is damaged."""
        record = durable.read_sealed(self.result_path(stage, key))
        if record is None or record.get("key") != key:
            return None
        folder = self._object(str(record["artifact"]))
        manifest = read_manifest(folder)
        if manifest is None or damaged_files(folder, manifest):
            return None
        return StoredResult(
            stage=stage,
            key=key,
            artifact=folder,
            content_digest=content_digest(manifest),
            metrics=dict(record["metrics"]),
            parts=dict(record["parts"]),
        )

    @contextlib.contextmanager
    def scratch_folder(self) -> Iterator[Path]:
        """A folder on the store's own file system that is gone afterwards unless it was published."""
        folder = durable.make_folder(self.scratch) / uuid.uuid4().hex
        with durable.told_plainly(folder):
            folder.mkdir()
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def put(self, folder: Path, stage: str, key: str, metrics: dict[str, Any], parts: dict[str, Any]) -> StoredResult:
        """Publish the files in ``folder`` as the artifact of ``key``; the folder is consumed."""
        files = {
            file.name: {"sha256": durable.file_sha256(file), "size": file.stat().st_size}
            for file in sorted(folder.iterdir())
        }
        manifest = {"files": files}
        data = durable.canonical_json(manifest)
        digest = durable.sha256(data)
        with durable.told_plainly(folder):
            (folder / MANIFEST).write_bytes(data)
        target = self._object(digest)
        kept = read_manifest(target)
        if kept is None or damaged_files(target, kept):
            durable.publish_folder(folder, target)
        record = {"stage": stage, "key": key, "artifact": digest, "metrics": metrics, "parts": parts}
        durable.write_sealed(self.result_path(stage, key), record)
        shutil.rmtree(self.checkpoint_folder(stage, key), ignore_errors=True)
        return StoredResult(stage, key, target, content_digest(manifest), metrics, parts)

    def entries(self) -> list[StoredResult]:
        """Every intact result, by stage and then by age."""
        found = []
        for path in sorted(self.results.glob("*/*.json"), key=lambda item: (item.parent.name, item.stat().st_mtime_ns)):
            result = self.find(path.parent.name, path.stem)
            if result is not None:
                found.append(result)
        return found

    def verify(self) -> list[Damage]:
        """Read every byte of the store; what is damaged or missing."""
        damage = []
        for path in sorted(self.results.glob("*/*.json")):
            record = durable.read_sealed(path)
            if record is None:
                damage.append(Damage(path, "the result's bytes are not those written"))
            elif not self._object(str(record["artifact"])).is_dir():
                damage.append(Damage(path, f"its artifact {str(record['artifact'])[:12]} is missing"))
        for folder in sorted(self.objects.glob("??/*")):
            if folder.name.startswith(durable.SCRATCH):
                continue
            manifest = read_manifest(folder)
            if manifest is None:
                damage.append(Damage(folder / MANIFEST, "the manifest is missing or its bytes are not those written"))
            else:
                damage.extend(Damage(folder / name, problem) for name, problem in damaged_files(folder, manifest))
        damage.extend(
            Damage(path, "the run's record is not as it was written")
            for path in sorted(self.home.glob("runs/*/run.json"))
            if durable.read_sealed(path) is None
        )
        return damage

    @contextlib.contextmanager
    def in_use(self) -> Iterator[None]:
        """Keep garbage collection away while a run goes on."""
        with self._lock(fcntl.LOCK_SH):
            yield

    def collect_garbage(self, keep_runs: int | None = None) -> list[Path]:
        """Delete what is damaged, what no result names, and what killed runs left in the scratch; what was deleted.

        With ``keep_runs``, runs but the newest so many are forgotten too, with all that only they used. Checkpoints
        of unfinished work are kept: they are what a rerun goes on from. Raises StoreError while a run goes on.
        """
        with self._lock(fcntl.LOCK_EX | fcntl.LOCK_NB):
            gone = self._forget_runs(keep_runs) if keep_runs is not None else []
            results = sorted(self.results.glob("*/*.json"))
            intact = {path: self.find(path.parent.name, path.stem) for path in results}
            named = {result.artifact for result in intact.values() if result is not None}
            gone += [path for path, result in intact.items() if result is None]
            gone += [folder for folder in self.objects.glob("??/*") if folder not in named]
            gone += [*self.scratch.glob("*"), *self.home.glob(f"**/{durable.SCRATCH}-*")]
            gone += [path for path in self.home.glob("runs/*/run.json") if durable.read_sealed(path) is None]
            for path in gone:
                if path.is_dir():
                    shutil.rmtree(path, ignore_errors=True)
                else:
                    path.unlink(missing_ok=True)
        return sorted(gone)

    def _forget_runs(self, keep: int) -> list[Path]:
        """Folders of all but the newest ``keep`` runs, and results that none of these used."""
        folders = sorted(path.parent for path in self.home.glob("runs/*/run.json"))
        forgotten, kept = folders[: max(0, len(folders) - keep)], folders[max(0, len(folders) - keep) :]
        records = [durable.read_sealed(folder / "run.json") or {"stages": []} for folder in kept]
        used = {(stage["name"], stage["key"]) for record in records for stage in record["stages"]}
        unused = [path for path in self.results.glob("*/*.json") if (path.parent.name, path.stem) not in used]
        for path in unused:
            path.unlink(missing_ok=True)
        return [*forgotten, *unused]

    @contextlib.contextmanager
    def _lock(self, how: int) -> Iterator[None]:
        path = durable.make_folder(self.home / "locks") / "home.lock"
        with durable.told_plainly(path):
            handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(handle, how)
            yield
        except BlockingIOError as error:
            raise StoreError(
                str(self.home), f"a run is using {self.home}; collect garbage when it has ended"
            ) from error
        finally:
            os.close(handle)

    def _object(self, digest: str) -> Path:
        return self.objects / digest[:2] / digest


def read_manifest(folder: Path) -> dict[str, Any] | None:
    """The manifest of an artifact's folder; None unless its digest is the folder's name."""
    try:
        data = (folder / MANIFEST).read_bytes()
    except OSError:
        return None
    return dict(json.loads(data)) if durable.sha256(data) == folder.name else None


def damaged_files(folder: Path, manifest: dict[str, Any]) -> list[tuple[str, str]]:
    """Each file of an artifact that is missing or whose bytes differ from the manifest, with what is wrong."""
    problems = []
    for name, facts in manifest["files"].items():
        path = folder / name
        try:
            if path.stat().st_size != facts["size"]:
                problems.append((name, f"has {path.stat().st_size} bytes, {facts['size']} were written"))
            elif durable.file_sha256(path) != facts["sha256"]:
                problems.append((name, "the bytes are not those written"))
        except OSError:
            problems.append((name, "is missing"))
    return problems


def content_digest(manifest: dict[str, Any]) -> str:
    """Digest of what later stages read of an artifact."""
    files = {name: facts["sha256"] for name, facts in manifest["files"].items() if name in NOUN}
    return durable.sha256(durable.canonical_json(files))
