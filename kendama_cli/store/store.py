"""The content-addressed store: artifacts by the digest of what they hold, results by the key of what made them.

``objects/ab/abcdef.../`` is one artifact: its files and ``manifest.json``, whose SHA-256 is the folder's name.
``results/STAGE/KEY.json`` says which artifact a key has. Both are sealed, so that any flipped byte is found.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from kendama_cli.errors import FormatError, ReadOnlyError, StoreError
from kendama_cli.store import durable
from kendama_cli.store.home import DIGEST, KEY, STAGE, claim
from kendama_cli.system.interface import system

MANIFEST = "manifest.json"
FORMAT = 1
"""Of an artifact's folder; it stands in the manifest. 0 is that of a manifest without a number, as 0.1 wrote it."""
ARTIFACT_FILES = ("artifact.json", "arrays.npz")
"""The files that later stages read; log and metrics do not enter their keys."""


@dataclass(frozen=True)
class StoredResult:
    """Result of a key: the artifact's folder and digests, its metrics, and the parts of the key."""

    stage: str
    key: str
    artifact: Path
    content_digest: str
    metrics: dict[str, Any]
    parts: dict[str, Any]
    made_with: dict[str, str]
    """Versions of the libraries that it was made with; they are no part of the key."""


@dataclass(frozen=True)
class SharedDamage:
    """One blob of a shared store that is not as it was written."""

    name: str
    problem: str


class Shared(Protocol):
    """A store that several homes share, behind one of them; what comes out of it was checked."""

    place: str
    """The folder or address, as messages name it."""

    def fetch(self, store: Store, stage: str, key: str, *, again: bool = False) -> bool:
        """Bring the result of ``key`` into the home; False where there is none that is sound."""

    def share(self, store: Store, result: StoredResult) -> bool:
        """Send a result to the other machines; return False if that is impossible now."""

    def verify(self, store: Store) -> tuple[int, list[SharedDamage]]:
        """Read every byte; return how many results and artifacts there are, and what is damaged.

        ``store`` lends room to unpack them, and keeps none.
        """


class Store:
    """The store in one home folder; every method is safe beside other processes on the same home."""

    def __init__(self, home: Path, shared: Shared | None = None) -> None:
        """Open the home, and ``shared`` behind it for results that are missing here."""
        self.home = home
        self.shared = shared
        self.objects = home / "objects"
        self.results = home / "results"
        self.checkpoints = home / "checkpoints"
        self.scratch = home / "scratch"
        self._is_claimed = False

    def claim(self) -> None:
        """Mark the home before anything is written; raises UsageError if it is a folder of another program."""
        if not self._is_claimed:
            claim(self.home)
            self._is_claimed = True

    def result_path(self, stage: str, key: str) -> Path:
        """Return the path of the result of ``key``, present or not."""
        return self.results / stage / f"{key}.json"

    def checkpoint_folder(self, stage: str, key: str) -> Path:
        """Return the folder of the unfinished work of ``key``."""
        return self.checkpoints / stage / key

    def find(self, stage: str, key: str) -> StoredResult | None:
        """Return the intact result of ``key``, from here or from the shared store; None if there is none.

        What is damaged counts as absent. Raises StoreError where something of it cannot be read now.
        """
        found = self._find_here(stage, key)
        if found is None and self.shared is not None and self.shared.fetch(self, stage, key):
            found = self._find_here(stage, key)
        return found

    def share(self, result: StoredResult) -> bool:
        """Send a result to the shared store, if there is one; return False if that is impossible now."""
        return self.shared is None or self.shared.share(self, result)

    def _find_here(self, stage: str, key: str) -> StoredResult | None:
        record = durable.read_sealed(self.result_path(stage, key))
        if record is None or record.get("key") != key or not DIGEST.fullmatch(str(record.get("artifact"))):
            return None
        folder = self.object_folder(str(record["artifact"]))
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
            made_with=dict(record["made_with"]),
        )

    @contextlib.contextmanager
    def scratch_folder(self) -> Iterator[Path]:
        """Yield a folder on the store's own file system that is deleted afterwards unless it was published."""
        self.claim()
        folder = durable.make_folder(self.scratch) / os.urandom(16).hex()
        with durable.plain_disk_errors(folder):
            folder.mkdir()
        try:
            yield folder
        finally:
            durable.remove_tree(folder, ignore_errors=True)

    def put(
        self,
        folder: Path,
        stage: str,
        key: str,
        metrics: dict[str, Any],
        parts: dict[str, Any],
        *,
        made_with: Mapping[str, str] | None = None,
    ) -> StoredResult:
        """Publish the files in ``folder`` as the artifact of ``key``; the folder is consumed."""
        with durable.readable(folder):
            files = {
                file.name: {"sha256": durable.file_sha256(file), "size": file.stat().st_size}
                for file in durable.listed(folder)
            }
        manifest = {"format": FORMAT, "files": files}
        data = durable.canonical_json(manifest)
        digest = durable.sha256(data)
        with durable.plain_disk_errors(folder):
            (folder / MANIFEST).write_bytes(data)
        target = self.object_folder(digest)
        kept = read_manifest(target)
        if kept is None or damaged_files(target, kept):
            durable.publish_folder(folder, target)
        record: dict[str, Any] = {"stage": stage, "key": key, "artifact": digest, "metrics": metrics, "parts": parts}
        record["made_with"] = dict(made_with or {})
        durable.write_sealed(self.result_path(stage, key), record)
        durable.remove_tree(self.checkpoint_folder(stage, key), ignore_errors=True)
        return StoredResult(stage, key, target, content_digest(manifest), metrics, parts, record["made_with"])

    def entries(self) -> list[StoredResult]:
        """Return every intact result, by stage and then by age."""
        paths = sorted(self.result_files(), key=lambda item: (item.parent.name, _written_ns(item), item.name))
        found = (self.find(path.parent.name, path.stem) for path in paths)
        return [result for result in found if result is not None]

    def result_files(self) -> list[Path]:
        """Return where the results stand, intact or not; files of other names are not ours."""
        stages = [stage for stage in durable.listed(self.results) if STAGE.fullmatch(stage.name)]
        files = [path for stage in stages for path in durable.listed(stage)]
        return [path for path in files if path.suffix == ".json" and KEY.fullmatch(path.stem)]

    @contextlib.contextmanager
    def in_use(self) -> Iterator[None]:
        """Keep garbage collection away while a run goes on; in a home that cannot be written nothing is collected."""
        with contextlib.ExitStack() as held:
            with contextlib.suppress(ReadOnlyError):
                path = self._lock_path()
                with durable.plain_disk_errors(path):
                    held.enter_context(system().shared(path))
            yield

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """Keep runs away meanwhile; raises StoreError while one goes on."""
        path = self._lock_path()
        with contextlib.ExitStack() as held:
            with durable.plain_disk_errors(path):
                try:
                    held.enter_context(system().alone(path))
                except BlockingIOError as error:
                    message = f"a run is using {self.home}; collect garbage when it has ended"
                    raise StoreError(str(self.home), message) from error
            yield

    def _lock_path(self) -> Path:
        self.claim()
        return durable.make_folder(self.home / "locks") / "home.lock"

    def object_folder(self, digest: str) -> Path:
        """Return the folder of the artifact of this digest, present or not."""
        return self.objects / digest[:2] / digest


def _written_ns(path: Path) -> int:
    with durable.readable(path):
        return path.stat().st_mtime_ns


def read_manifest(folder: Path) -> dict[str, Any] | None:
    """Return the manifest of an artifact's folder; None unless its digest is the folder's name.

    Raises StoreError where it cannot be read now, FormatError where it is whole and of another format.
    """
    data = durable.read_file(folder / MANIFEST)
    return None if data is None else manifest_in(data, folder.name, str(folder / MANIFEST))


def manifest_in(data: bytes, digest: str, location: str) -> dict[str, Any] | None:
    """Return the manifest in ``data``; None unless ``digest`` is its digest.

    Raises FormatError, naming ``location``, where it is whole and of another format.
    """
    if durable.sha256(data) != digest:
        return None
    manifest = dict(json.loads(data))
    if manifest.get("format", 0) != FORMAT:
        raise FormatError(location, "an artifact", manifest.get("format", 0), FORMAT)
    return manifest


def key_of(parts: Any) -> str:
    """Return the key of ``parts``."""
    return durable.sha256(durable.canonical_json(parts))[:40]


def damaged_files(folder: Path, manifest: dict[str, Any]) -> list[tuple[str, str]]:
    """Return each file of an artifact that is missing or whose bytes differ from the manifest, with its fault.

    Raises StoreError where one cannot be read now.
    """
    problems = []
    for name, facts in manifest["files"].items():
        path = folder / name
        with durable.readable(path):
            try:
                size = path.stat().st_size
                if size != facts["size"]:
                    problems.append((name, f"has {size} bytes, {facts['size']} were written"))
                elif durable.file_sha256(path) != facts["sha256"]:
                    problems.append((name, "the bytes are not those written"))
            except (FileNotFoundError, NotADirectoryError):
                problems.append((name, "is missing"))
    return problems


def content_digest(manifest: dict[str, Any]) -> str:
    """Return the digest of the parts of an artifact that later stages read."""
    files = {name: facts["sha256"] for name, facts in manifest["files"].items() if name in ARTIFACT_FILES}
    return durable.sha256(durable.canonical_json(files))
