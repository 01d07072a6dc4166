"""The workers of a Dask cluster as those that compute stages: one task for each stage, its Dask key the stage's key.

So the scheduler computes a stage once, whoever asks for it. What comes back is the way by which the stage ended; its
artifact comes through the shared store.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import logging
import os
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any

from kendama_cli.errors import ClusterError, MissingPartError, install_line
from kendama_cli.plugins.cluster.settings import DaskExecutor, SlurmExecutor
from kendama_cli.plugins.cluster.shared import SharedStore
from kendama_cli.plugins.cluster.task import OUTCOME, PROGRESS, compute, what_runs_here
from kendama_cli.settings.store import StoreSettings
from kendama_cli.store.store import Store
from kendama_cli.system.interface import Lock, Worker
from kendama_cli.system.processes import cores_shared_by

try:
    import dask
    import distributed
except ImportError as missing:
    raise MissingPartError(
        "distributed", f"executor=dask and executor=slurm need Dask: {install_line('dask')}"
    ) from missing

RUNS_PER_THREAD = 4
"""Runs of a sweep that wait for each thread of the cluster, so that none is idle between two stages."""
LEAST_RUNS, MOST_RUNS = 8, 256
UNWATCHED = {"distributed.worker.profile.enabled": False, "distributed.admin.tick.interval": "1s"}
"""Our own cluster has no dashboard: nobody sees its profiles (100 looks a second) and its lags (50 a second)."""


@contextlib.contextmanager
def connected(
    executor: DaskExecutor | SlurmExecutor, shared: StoreSettings, store: Store, tell: Callable[[str], None]
) -> Iterator[DaskCluster]:
    """Connect to the cluster that ``executor`` names, until the end; raises ClusterError if it cannot be reached."""
    _silence()
    with contextlib.ExitStack() as held:
        client, threads = held.enter_context(_opened(executor, store.home))
        _refuse_another_kind(client)
        cluster = DaskCluster(client, store, shared, executor.workers_home, threads)
        if isinstance(executor, SlurmExecutor):
            from kendama_cli.plugins.cluster.slurm import watched_jobs  # noqa: PLC0415 - as in _opened

            held.enter_context(watched_jobs(client.cluster, executor, tell, cluster.give_up))
        elif not client.scheduler_info()["workers"]:
            tell(f"the scheduler at {client.scheduler.address} has no workers yet; stages wait for them")
        yield cluster


def _silence() -> None:
    """Silence Dask's log, which prints a traceback for each task that it loses: errors are told in our own line."""
    for name in ("distributed", "tornado", "asyncio", *logging.root.manager.loggerDict):
        if name.partition(".")[0] in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


@contextlib.contextmanager
def _opened(executor: DaskExecutor | SlurmExecutor, home: Path) -> Iterator[tuple[distributed.Client, int]]:
    if isinstance(executor, SlurmExecutor):
        from kendama_cli.plugins.cluster.slurm import slurm_jobs  # noqa: PLC0415 - a library of its own

        with slurm_jobs(executor, home) as cluster, distributed.Client(cluster, set_as_default=False) as client:
            yield client, executor.jobs * executor.cores
    elif executor.scheduler is None:
        count = executor.workers or os.cpu_count() or 1
        with cores_shared_by(count):
            cluster = _workers_here(count)
        with cluster, distributed.Client(cluster, set_as_default=False) as client:
            yield client, count
    else:
        with _client(executor, executor.scheduler) as client:
            workers = client.scheduler_info(n_workers=-1)["workers"].values()
            yield client, sum(int(worker["nthreads"]) for worker in workers)


def _workers_here(count: int) -> distributed.LocalCluster:
    """Start a scheduler and workers on this machine: on loopback, and behind certificates of their own."""
    with dask.config.set(UNWATCHED):
        return distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address=None,
            security=distributed.Security.temporary(),
            silence_logs=logging.CRITICAL,
        )


def _client(executor: DaskExecutor, address: str) -> distributed.Client:
    ca, cert, key = (_file(address, name, getattr(executor, name)) for name in ("tls_ca", "tls_cert", "tls_key"))
    security = distributed.Security(
        tls_ca_file=ca, tls_client_cert=cert, tls_client_key=key, require_encryption=ca is not None
    )
    try:
        if ca is not None:
            security.get_connection_args("client")
    except OSError as error:  # ssl.SSLError is one
        raise ClusterError(
            address, f"executor.tls_ca, tls_cert, tls_key: they are no certificates with their key ({error})"
        ) from error
    try:
        return distributed.Client(address, security=security, timeout=executor.connect_s, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = " ".join(str(error.__cause__ or error).split()).rpartition(">: ")[2][:200]
        message = f"executor.scheduler={address}: no Dask scheduler answers there ({reason}); begin one with"
        raise ClusterError(address, f"{message} 'dask scheduler'") from error


def _file(address: str, name: str, given: str | None) -> str | None:
    """Return the certificate or key that a setting names; raises ClusterError where there is no such file."""
    if given is None:
        return None
    path = os.path.expanduser(given)
    if not os.path.isfile(path):
        raise ClusterError(address, f"executor.{name}: no such file '{given}'")
    return path


def _refuse_another_kind(client: distributed.Client) -> None:
    """Raise ClusterError where a worker could not compute what we would."""
    here = what_runs_here()
    address = str(client.scheduler.address)
    try:
        found = client.run(what_runs_here, on_error="return")
    except OSError as error:
        raise ClusterError(address, f"the scheduler at {address} was lost; the same command goes on") from error
    for worker, one in found.items():
        if not isinstance(one, dict):
            raise ClusterError(address, f"the worker {worker} has no kendama ({one}); install the same there")
        for name, wanted in here.items():
            if one[name] != wanted:
                raise ClusterError(
                    address, f"the worker {worker} has {name} {one[name]}, here it is {wanted}; install the same there"
                )


class DaskCluster:
    """See ``Cluster``."""

    def __init__(
        self, client: distributed.Client, store: Store, shared: StoreSettings, workers_home: str, threads: int
    ) -> None:
        self._client = client
        self._store = store
        if "://" not in str(shared.remote):  # the workers begin in folders of their own
            shared = dataclasses.replace(shared, remote=os.path.abspath(os.path.expanduser(str(shared.remote))))
        self._sent = {"store": dataclasses.asdict(shared), "workers_home": workers_home, "sender": what_runs_here()}
        self.at_once = min(MOST_RUNS, max(LEAST_RUNS, RUNS_PER_THREAD * threads))
        self._tasks: dict[str, _Task] = {}
        self._given_up: ClusterError | None = None
        client.subscribe_topic(PROGRESS, self._progress)
        client.subscribe_topic(OUTCOME, self._outcome)

    def start(self, request: Mapping[str, Any], *, lock: Lock, printed: int) -> Worker:
        """Submit the stage; ``lock`` stays here, what it printed comes to the file descriptor ``printed`` at the end.

        Raises ClusterError where the scheduler is lost, RemoteError where its inputs cannot be given to the workers.
        """
        if self._given_up is not None:
            raise self._given_up
        address = str(self._client.scheduler.address if self._client.scheduler else "?")
        shared = self._store.shared
        assert isinstance(shared, SharedStore)
        for one in request["given"].values():
            result = self._store.find(one["stage"], one["key"])
            if result is None or not shared.share(self._store, result):
                raise ClusterError(address, f"{shared.remote.place} does not take the results that workers need")
        for path, facts in request["files"].items():
            shared.share_file(Path(path), facts["sha256"])
        key = f"{request['stage']}-{request['key']}"
        if request["fresh"]:
            key += f"-{os.urandom(4).hex()}"  # not what somebody else computes or has computed
        text = json.dumps({**request, **self._sent})
        try:
            future = self._client.submit(compute, text, key=key, pure=False)
        except Exception as error:  # Dask raises many kinds where it has lost its scheduler
            raise _lost(address) from error
        task = _Task(future, self._store, request, os.dup(printed), _lost(address))
        self._tasks[key] = task
        future.add_done_callback(lambda done: self._ended(key, task, done))
        return task

    def close(self) -> None:
        """Do nothing: nothing is held between stages."""

    def give_up(self, message: str) -> None:
        """End every stage with ``message``, and begin none: nobody will compute any more."""
        self._given_up = ClusterError(str(self._client.scheduler.address), message)
        for task in list(self._tasks.values()):
            task.lose(self._given_up)

    def _ended(self, key: str, task: _Task, future: distributed.Future) -> None:
        self._tasks.pop(key, None)
        task.ended(future)

    def _progress(self, event: tuple[float, Mapping[str, Any]]) -> None:
        _, told = event
        task = self._tasks.get(str(told.get("key")))
        if task is not None:
            task.tell({**told, "event": "progress"})

    def _outcome(self, event: tuple[float, Mapping[str, Any]]) -> None:
        _, told = event
        task = self._tasks.get(str(told.get("key")))
        if task is not None:
            task.answer = str(told["answer"])


def _lost(address: str) -> ClusterError:
    return ClusterError(
        address, f"the scheduler at {address} is gone; begin it and its workers again, then the same command goes on"
    )


class _Task:
    """A stage that computes somewhere: it looks like a worker process of ours."""

    events: IO[bytes]
    answer: str | None = None
    """The task's result, where it was told before Dask knew that the task has ended."""

    def __init__(
        self, future: distributed.Future, store: Store, request: Mapping[str, Any], printed: int, lost: ClusterError
    ) -> None:
        read, self._write = os.pipe()
        self.events = os.fdopen(read, "rb")
        self._future, self._store, self._printed, self._lost = future, store, printed, lost
        self._stage, self._key = str(request["stage"]), str(request["key"])
        self._lock, self._open, self._code = threading.Lock(), True, 1

    def tell(self, event: Mapping[str, Any]) -> None:
        """Report ``event``, unless all is over."""
        with self._lock, contextlib.suppress(OSError):
            if self._open:
                os.write(self._write, json.dumps(event).encode() + b"\n")

    def ended(self, future: distributed.Future) -> None:
        """Take the task's result, called by Dask from a thread of its own."""
        event = self._outcome(future)
        with contextlib.suppress(OSError):
            os.write(self._printed, event.pop("printed", "").encode(errors="replace"))
        if event["event"] == "ended":
            self._code = event["code"]
        else:
            self._code = 0 if event["event"] == "done" else 1
            self.tell(event)
        self._close()

    def ask_to_end(self) -> None:
        """Stop waiting for it; if nobody else waits, its worker interrupts it."""
        self._future.cancel(reason="kendama was interrupted")
        self._close()

    def lose(self, reason: ClusterError) -> None:
        """End it as failed, by ``reason``."""
        self._lost = reason
        self._future.cancel()

    def kill(self) -> None:
        """Ask the task to end, as ``ask_to_end`` does."""
        self.ask_to_end()

    def wait(self, timeout: float | None = None) -> int:
        """Return its exit code; the artifact is in the home then, if the shared store has it."""
        if self._code == 0 and self._store.shared is not None:
            self._store.shared.fetch(self._store, self._stage, self._key, again=True)
        self._future.release()
        return self._code

    def _outcome(self, future: distributed.Future) -> dict[str, Any]:
        try:
            told = self.answer if future.status == "finished" else None
            return dict(json.loads(future.result() if told is None else told))
        except distributed.KilledWorker:
            message = "it ended several workers, one after the other (out of memory?); the same command tries again"
        except (distributed.CancelledError, OSError):
            message = str(self._lost)
        except Exception as error:
            message = f"its worker cannot compute it ({type(error).__name__}: {error})"
        return {"event": "failed", "message": " ".join(message.split()), "unexpected": False}

    def _close(self) -> None:
        with self._lock:
            if self._open:
                self._open = False
                os.close(self._write)
                os.close(self._printed)
