"""The shared store behind a home: results and artifacts that other machines made, checked before they are used.

``results/STAGE/KEY.json`` is a sealed record as in a home, ``objects/ab/DIGEST.tar`` an artifact. An artifact is there
before a result names it. Who writes what stands there already writes the same bytes, or another result as good.
"""

from __future__ import annotations

import io
import os
import re
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from kendama_cli.errors import OfflineError, ReadOnlyError, RemoteError
from kendama_cli.plugins.cluster.packed import pack, packed_bytes, unpack
from kendama_cli.plugins.cluster.remote import SMALL_BYTES, Remote, open_remote
from kendama_cli.settings.store import StoreSettings
from kendama_cli.store import durable
from kendama_cli.store.home import DIGEST, KEY, STAGE
from kendama_cli.store.store import SharedDamage, Store, StoredResult, damaged_files, key_of, read_manifest

ABSENT_S = 2.0
"""So long what was not there is not asked for again: a stage that waits for another looks ten times a second."""
OFFLINE_S = 60.0
"""So long a store that was out of reach is not asked again."""
AT_ONCE = 8
_RESULT = re.compile(rf"results/(?P<stage>{STAGE.pattern})/(?P<key>{KEY.pattern})\.json")
_OBJECT = re.compile(rf"objects/[0-9a-f]{{2}}/{DIGEST.pattern}\.tar")


class SharedStore:
    """A ``Remote`` as the homes of one process use it; ``tell`` is called once where it is out of reach."""

    def __init__(self, remote: Remote, tell: Callable[[str], None]) -> None:
        self.remote = remote
        self.place = remote.place
        self._tell = tell
        self._offline_until_s = 0.0
        self._absent_s: dict[tuple[str, str], float] = {}
        self._damaged: set[str] = set()
        self._given: set[str] = set()
        self._lock = threading.Lock()

    @property
    def is_offline(self) -> bool:
        """Return True if the store was out of reach a moment ago."""
        return time.monotonic() < self._offline_until_s

    def fetch(self, store: Store, stage: str, key: str, *, again: bool = False) -> bool:
        """Bring the result of ``key`` with its artifact into the home; False where there is none that is sound.

        What was not there is asked for ``again`` at once, or after ABSENT_S. Raises RemoteError where the shared store
        is none; offline, the home has to do.
        """
        asked_s = self._absent_s.get((stage, key))
        if self.is_offline or (not again and asked_s is not None and time.monotonic() - asked_s < ABSENT_S):
            return False
        try:
            problem = receive(self.remote, store, stage, key)
        except OfflineError as error:
            self._go_offline(error)
            return False
        if problem is not None:
            self._damaged |= {problem.name, _result_name(stage, key)}
            self._tell(f"{self.remote.place}: {problem.name} is damaged ({problem.problem}); it is made again")
        found = problem is None and durable.exists(store.result_path(stage, key))
        if not found:
            self._absent_s[stage, key] = time.monotonic()
        return found

    def share(self, store: Store, result: StoredResult) -> bool:
        """Give a result with its artifact to the others; False where that cannot be done now, which is told once."""
        name = _result_name(result.stage, result.key)
        if name in self._given:
            return True
        if self.is_offline:
            return False
        try:
            send(self.remote, store, result, anew=self._damaged)
        except (ReadOnlyError, RemoteError) as error:
            self._go_offline(error)
            return False
        self._given.add(name)
        return True

    def verify(self, store: Store) -> tuple[int, list[SharedDamage]]:
        """Read every byte of it: see ``verify_remote``."""
        return verify_remote(store, self.remote)

    def share_file(self, path: Path, digest: str) -> None:
        """Give an input file of a stage to the others; raises RemoteError where that cannot be done now."""
        name = _file_name(digest)
        if name not in self._given and self.remote.size(name) != path.stat().st_size:
            self.remote.put(name, path)
        self._given.add(name)

    def fetch_file(self, digest: str, target: Path) -> None:
        """Bring an input file to the new file ``target``; raises RemoteError where it is not there, or is damaged."""
        scratch = durable.make_folder(target.parent) / f"{durable.SCRATCH}-{os.urandom(16).hex()}"
        with durable.plain_disk_errors(target):
            try:
                there = self.remote.fetch(_file_name(digest), scratch)
                if not there or durable.file_sha256(scratch) != digest:
                    what = f"{self.remote.place}: the input {_file_name(digest)}"
                    raise RemoteError(self.remote.place, f"{what} {'is damaged; delete it' if there else 'is missing'}")
                durable.copy_file(scratch, target)
            finally:
                scratch.unlink(missing_ok=True)

    def _go_offline(self, error: Exception) -> None:
        with self._lock:
            told, self._offline_until_s = self.is_offline, time.monotonic() + OFFLINE_S
        if not told:
            self._tell(f"{error}; the work goes on with the home alone ('kendama cache push' shares it later)")


def open_shared(settings: StoreSettings, tell: Callable[[str], None]) -> SharedStore | None:
    """Open the shared store that ``settings`` name; None if they name none."""
    remote = open_remote(settings)
    return None if remote is None else SharedStore(remote, tell)


def receive(remote: Remote, store: Store, stage: str, key: str) -> SharedDamage | None:
    """Bring a result, where there is one, into the home; nothing comes in that is not what its digests say."""
    name = _result_name(stage, key)
    data = remote.read(name)
    if data is None:
        return None
    record = _checked(data, name, stage, key)
    if isinstance(record, SharedDamage):
        return record
    digest = str(record["artifact"])
    if not _is_whole(store.object_folder(digest)):
        damage = _receive_artifact(remote, store, digest)
        if damage is not None:
            return damage
    durable.write_sealed(store.result_path(stage, key), record)
    return None


def send(remote: Remote, store: Store, result: StoredResult, *, anew: set[str] | frozenset[str] = frozenset()) -> bool:
    """Give a result to the shared store; whether anything was missing there. Blobs in ``anew`` are written again."""
    digest, wrote = result.artifact.name, False
    manifest = read_manifest(result.artifact)
    if manifest is None:
        return False
    name = _object_name(digest)
    if name in anew or remote.size(name) != packed_bytes(manifest):
        _send_artifact(remote, store, result.artifact, manifest)
        wrote = True
    name, path = _result_name(result.stage, result.key), store.result_path(result.stage, result.key)
    standing = None if name in anew else remote.read(name)
    if standing is None or isinstance(_checked(standing, name, result.stage, result.key), SharedDamage):
        remote.put(name, path)
        wrote = True
    return wrote


def push(store: Store, remote: Remote) -> tuple[int, int]:
    """Share every result of the home; how many there are, and how many were missing there."""
    with ThreadPoolExecutor(AT_ONCE) as pool, store.in_use():
        sent = list(pool.map(lambda result: send(remote, store, result), store.entries()))
    return len(sent), sum(sent)


def pull(store: Store, remote: Remote) -> tuple[int, list[SharedDamage]]:
    """Bring every result that the home lacks into it; how many came, and what was damaged."""
    wanted = [(stage, key) for stage, key in _results(remote) if store.find(stage, key) is None]
    with ThreadPoolExecutor(AT_ONCE) as pool, store.in_use():
        problems = list(pool.map(lambda one: receive(remote, store, *one), wanted))
    damage = [problem for problem in problems if problem is not None]
    return len(wanted) - len(damage), damage


def verify_remote(store: Store, remote: Remote) -> tuple[int, list[SharedDamage]]:
    """Read every blob; how many there are, and which are damaged. ``store`` lends room to unpack them, and keeps none.

    An artifact that no result names is sound, and in nobody's way: a writer may be about to name it.
    """
    results = list(_results(remote))
    objects = [name for name in remote.names("objects") if _OBJECT.fullmatch(name)]

    def result(one: tuple[str, str]) -> SharedDamage | None:
        name = _result_name(*one)
        record = _checked(remote.read(name) or b"", name, *one)
        if isinstance(record, SharedDamage):
            return record
        missing = _object_name(str(record["artifact"])) not in known
        return SharedDamage(name, f"its artifact {str(record['artifact'])[:12]} is missing") if missing else None

    def packed(name: str) -> SharedDamage | None:
        with store.scratch_folder() as folder:
            return _unpacked(remote, folder, Path(name).stem, name)

    known = set(objects)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        found = [*pool.map(result, results), *pool.map(packed, objects)]
    return len(found), [one for one in found if one is not None]


def _results(remote: Remote) -> Iterator[tuple[str, str]]:
    """Yield stage and key of every result; whatever else lies there is not ours."""
    for found in map(_RESULT.fullmatch, remote.names("results")):
        if found is not None:
            yield found["stage"], found["key"]


def _result_name(stage: str, key: str) -> str:
    return f"results/{stage}/{key}.json"


def _object_name(digest: str) -> str:
    return f"objects/{digest[:2]}/{digest}.tar"


def _file_name(digest: str) -> str:
    return f"files/{digest[:2]}/{digest}"


def _checked(data: bytes, name: str, stage: str, key: str) -> dict[str, Any] | SharedDamage:
    """Return the record of a result, or a sentence about the error if it is not one of ``key``."""
    record = durable.unsealed(data, name)
    if record is None:
        return SharedDamage(name, "the result's bytes are not those written")
    told = (record.get("stage"), record.get("key"))
    if told != (stage, key) or key_of(record.get("parts")) != key or not isinstance(record.get("metrics"), dict):
        return SharedDamage(name, "it is the result of another key")
    if not DIGEST.fullmatch(str(record.get("artifact"))) or not isinstance(record.get("made_with"), dict):
        return SharedDamage(name, "it names no artifact")
    return record


def _is_whole(folder: Path) -> bool:
    manifest = read_manifest(folder)
    return manifest is not None and not damaged_files(folder, manifest)


def _send_artifact(remote: Remote, store: Store, artifact: Path, manifest: dict[str, Any]) -> None:
    name = _object_name(artifact.name)
    if packed_bytes(manifest) <= SMALL_BYTES:
        packed = io.BytesIO()
        with durable.readable(artifact):
            pack(artifact, manifest, packed)
        remote.put(name, packed.getvalue())
        return
    with store.scratch_folder() as folder:
        with durable.plain_disk_errors(folder), (folder / "pack").open("wb") as stream:
            pack(artifact, manifest, stream)
        remote.put(name, folder / "pack")


def _receive_artifact(remote: Remote, store: Store, digest: str) -> SharedDamage | None:
    with store.scratch_folder() as folder:
        damage = _unpacked(remote, folder, digest, _object_name(digest))
        if damage is None:
            durable.publish_folder(folder, store.object_folder(digest))
        return damage


def _unpacked(remote: Remote, folder: Path, digest: str, name: str) -> SharedDamage | None:
    """Lay a pack out in the empty ``folder``; what is wrong with it, if anything is."""
    scratch = folder.with_suffix(".pack")
    with durable.plain_disk_errors(folder):
        try:
            packed = remote.opened(name, scratch)
            if packed is None:
                return SharedDamage(name, "it is missing")
            with packed:
                problem = unpack(packed, digest, folder)
        finally:
            scratch.unlink(missing_ok=True)
    return None if problem is None else SharedDamage(name, problem)
