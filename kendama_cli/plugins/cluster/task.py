"""Task of a Dask worker for one stage: take the inputs from the shared store, compute, store the result there.

The stage itself computes in a process of its own, as on every machine; the Dask worker only watches it. Requests and
answers are JSON texts: nothing of ours is pickled.
"""

from __future__ import annotations

import contextlib
import functools
import json
import os
import platform
import queue
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from kendama_cli.errors import KendamaError, RemoteError, StageError
from kendama_cli.pipeline.code import FileIndex, code_digest
from kendama_cli.plugins.cluster.remote import Remote, open_remote
from kendama_cli.plugins.cluster.shared import SharedStore
from kendama_cli.schema.settings import build
from kendama_cli.settings.store import StoreSettings
from kendama_cli.store import durable
from kendama_cli.store.store import Store
from kendama_cli.system.interface import Lock, Starter, Worker, system
from kendama_cli.system.processes import PROCESSES, processes
from kendama_cli.version import __version__

POLL_S = 0.2
GRACE_S = 5.0
PRINTED_BYTES = 64_000
"""So much of the end of what a stage printed travels back."""
PROGRESS = "kendama-progress"
"""The Dask topic of how far stages are."""
OUTCOME = "kendama-outcome"
"""The Dask topic of how stages ended: who waits hears it without fetching the task's result from its worker."""
OUTCOME_BYTES = 4096
"""A longer answer is not told so: every client of the scheduler hears it, and the scheduler keeps it a while."""

ENDING = ("closing", "closed", "failed")

Progress = Callable[[Mapping[str, Any]], None]
_starters: queue.SimpleQueue[Starter] = queue.SimpleQueue()
"""Kept between tasks: each has the imports of the stages behind it that it started before."""

_code: dict[str, str | None] = {}


def compute(text: str) -> str:
    """Carry out the request ``text`` on this Dask worker; how it ended. Never raises what a stage may meet."""
    from distributed import get_worker  # noqa: PLC0415 - on the workers of a cluster only
    from distributed.worker import thread_state  # noqa: PLC0415

    worker, key = get_worker(), thread_state.key
    os.environ.setdefault(PROCESSES, str(max(1, processes() // worker.state.nthreads)))  # each stage takes its share

    def is_wanted() -> bool:
        task = worker.state.tasks.get(key)
        return task is not None and task.state != "cancelled" and worker.status.name not in ENDING

    def tell(event: Mapping[str, Any]) -> None:
        worker.log_event(PROGRESS, {**event, "key": str(key)})

    answer = json.dumps({**carry_out(json.loads(text), tell, is_wanted), "worker": str(worker.address)})
    if len(answer) <= OUTCOME_BYTES:
        worker.log_event(OUTCOME, {"key": str(key), "answer": answer})
    return answer


def what_runs_here() -> dict[str, str]:
    """Return the versions that a worker must have in common with who sends it work."""
    return {"kendama": __version__, "Python": ".".join(platform.python_version_tuple()[:2])}


def carry_out(request: Mapping[str, Any], tell: Progress, is_wanted: Callable[[], bool]) -> dict[str, Any]:
    """Run the stage of ``request``; return the event by which it ended, with what it printed."""
    try:
        home = durable.make_folder(Path(request["workers_home"]).expanduser() / platform.node())
        remote = _remote(json.dumps(request["store"]))
        complaints: list[str] = []
        store = Store(home, SharedStore(remote, complaints.append))
        with store.in_use():
            _refuse_another_kind(request, home)
            done = _done(request, store, tell, is_wanted)
        if done["event"] == "done" and not done["shared"]:
            raise RemoteError(remote.place, f"{complaints[-1] if complaints else remote.place} (on {platform.node()})")
        return done
    except KendamaError as error:
        return {"event": "failed", "message": str(error), "unexpected": False}


@functools.cache
def _remote(settings: str) -> Remote:
    """Open the shared store that ``settings`` name, as JSON: tasks use one client of a bucket, and its connections."""
    remote = open_remote(build(StoreSettings, json.loads(settings)))
    assert remote is not None
    return remote


def _refuse_another_kind(request: Mapping[str, Any], home: Path) -> None:
    """Raise StageError where this worker would not compute what the key says."""
    here = what_runs_here()
    for name, wanted in request["sender"].items():
        if here[name] != wanted:
            raise StageError(f"the worker on {platform.node()} has {name} {here[name]}, the key is of {wanted}")
    wanted_code = request["parts"]["code"]
    _look_at_code(wanted_code, home)
    differing = [place for place, digest in wanted_code.items() if _code[place] != digest]
    if differing:
        raise StageError(
            f"the worker on {platform.node()} has other code in {differing[0]}; install the same there, begin it anew"
        )


def _look_at_code(places: Iterable[str], home: Path) -> None:
    """Have the digests of the code in ``places`` as this process first saw it: later changes are not what it runs."""
    new = [place for place in places if place not in _code]
    if new:
        index = FileIndex(home / "index" / "files.json")
        _code.update({place: code_digest(place, index) for place in new})
        index.save()


def _done(request: Mapping[str, Any], store: Store, tell: Progress, is_wanted: Callable[[], bool]) -> dict[str, Any]:
    with _locked(store, request, is_wanted) as lock:
        found = None if request["fresh"] else store.find(request["stage"], request["key"])
        event: dict[str, Any] = {"event": "done", "seconds": 0.0}
        if found is None:
            began_s = time.monotonic()
            event = _run(_at_home(request, store), lock, tell, is_wanted)
            event["seconds"] = time.monotonic() - began_s
            found = store.find(request["stage"], request["key"]) if event["event"] == "done" else None
    return event if found is None else {**event, "shared": store.share(found)}


@contextlib.contextmanager
def _locked(store: Store, request: Mapping[str, Any], is_wanted: Callable[[], bool]) -> Iterator[Lock]:
    """Hold the stage's key on this machine; another task here may compute it for somebody else."""
    path = durable.make_folder(store.home / "locks") / f"{request['stage']}-{request['key']}.lock"
    while True:
        with durable.plain_disk_errors(path):
            lock = system().try_lock(path)
        if lock is not None:
            break
        if not is_wanted():
            raise StageError("nobody waits for it any more")
        time.sleep(POLL_S)
    try:
        yield lock
    finally:
        lock.release()


def _at_home(request: Mapping[str, Any], store: Store) -> dict[str, Any]:
    """Return ``request`` with the paths of inputs and files on this machine."""
    given = {}
    for own, one in request["given"].items():
        result = store.find(one["stage"], one["key"])
        if result is None:
            raise StageError(f"the shared store does not have the input '{own}' of stage '{request['stage']}'")
        given[own] = {"folder": str(result.artifact), "returns": one["returns"]}
    return {**request, "given": given, "home": str(store.home), "places": placed_files(request["files"], store)}


def _run(request: Mapping[str, Any], lock: Lock, tell: Progress, is_wanted: Callable[[], bool]) -> dict[str, Any]:
    """Run the stage in a process that holds the lock even if this one is killed; return the event by which it ended."""
    try:
        starter = _starters.get_nowait()
    except queue.Empty:
        starter = system().sweep_starter()
    try:
        with tempfile.TemporaryFile() as printed:
            process = starter.start(request, lock=lock, printed=printed.fileno())
            event = _watched(process, tell, is_wanted)
            printed.seek(max(0, printed.seek(0, 2) - PRINTED_BYTES))
            return {**event, "printed": printed.read().decode(errors="replace")}
    finally:
        _starters.put(starter)


def _watched(process: Worker, tell: Progress, is_wanted: Callable[[], bool]) -> dict[str, Any]:
    ended = threading.Event()

    def end_when_unwanted() -> None:
        while not ended.wait(POLL_S):
            if not is_wanted():
                process.ask_to_end()
                if not ended.wait(GRACE_S):
                    process.kill()
                return

    threading.Thread(target=end_when_unwanted, daemon=True).start()
    last: dict[str, Any] = {}
    with process.events as events:
        for line in events:
            if not line.endswith(b"\n"):
                continue
            event = json.loads(line)
            if event["event"] == "progress":
                tell(event)
            else:
                last = event
    code = process.wait()
    ended.set()
    return last or {"event": "ended", "code": code}


def placed_files(files: Mapping[str, Mapping[str, str]], store: Store) -> dict[str, str]:
    """Place the sender's ``files`` on this machine; return their paths here by those there, empty if the same.

    Files that belong together stand in one folder as they did there. Raises RemoteError where one is nowhere.
    """
    if all(_is_here(path, facts["sha256"]) for path, facts in files.items()):
        return {}
    assert isinstance(store.shared, SharedStore)
    inputs = store.home / "inputs" / durable.sha256(durable.canonical_json(files))[:32]
    places = {}
    for path, facts in files.items():
        folder = os.path.dirname(facts["beside"])
        inside = os.path.relpath(path, folder)
        if inside.startswith(os.pardir):
            raise StageError(f"{facts['beside']} lists {inside}: a table's files must be below its folder to travel")
        # a bag is called by its folder
        place = inputs / durable.sha256(folder.encode())[:16] / os.path.basename(folder) / inside
        if not _is_here(str(place), facts["sha256"]):
            store.shared.fetch_file(facts["sha256"], place)
        places[path] = str(place)
    return places


def _is_here(path: str, digest: str) -> bool:
    try:
        return durable.file_sha256(Path(path)) == digest
    except OSError:
        return False
