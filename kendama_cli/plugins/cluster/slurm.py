"""Jobs of a Slurm cluster as Dask workers, by ``dask-jobqueue``; the scheduler is this process's own."""

from __future__ import annotations

import contextlib
import getpass
import logging
import os
import re
import shutil
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from kendama_cli.errors import ClusterError, MissingPartError, install_line
from kendama_cli.plugins.cluster.settings import SlurmExecutor
from kendama_cli.schema.units import count_of
from kendama_cli.store import durable

try:
    import dask_jobqueue
    import distributed
except ImportError as missing:
    raise MissingPartError(
        "dask-jobqueue", f"executor=slurm needs Dask and dask-jobqueue: {install_line('dask')}"
    ) from missing

JOB_NAME = "kendama"
WATCH_S = 2.0
ASK_S = 20.0
"""So long Slurm's own commands may take."""
FUTILE = 3
"""After so many jobs in a row that ended without a word, or as many as there are, no further ones are asked for."""
PLAIN_PATH = re.compile(r"[\w./+@=:,-]+")
"""What a job's script holds as it is; dask-jobqueue quotes nothing."""


@contextlib.contextmanager
def slurm_jobs(executor: SlurmExecutor, home: Path) -> Iterator[dask_jobqueue.SLURMCluster]:
    """Start a cluster of ``executor.jobs`` jobs, each replaced where it ends, all ended at the end.

    The nodes must see ``home``: what the jobs print and the certificates of this command stand there meanwhile. Raises
    ClusterError where Slurm is not here, or refuses.
    """
    if shutil.which("sbatch") is None:
        raise _refused("this machine has no 'sbatch'; begin on a login node of the cluster")
    if not PLAIN_PATH.fullmatch(str(home)):
        raise _refused(f"the path {str(home)!r} cannot stand in a job's script; choose another folder with --home")
    folder = durable.make_folder(home / "slurm" / os.urandom(8).hex())
    try:
        with _scheduler(executor, folder) as cluster:
            _ask_whether_taken(cluster.job_script(), folder / "job.sh")
            # a job that its time limit or its node's death ended is followed by another
            cluster.adapt(minimum_jobs=executor.jobs, maximum_jobs=executor.jobs)
            yield cluster
    finally:
        durable.remove_tree(folder, ignore_errors=True)


def _scheduler(executor: SlurmExecutor, folder: Path) -> dask_jobqueue.SLURMCluster:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of options that it would like to have otherwise
            return dask_jobqueue.SLURMCluster(
                queue=executor.partition,
                account=executor.account,
                interface=executor.interface,
                walltime=executor.time,
                memory=executor.memory,
                cores=executor.cores,
                processes=1,
                job_name=JOB_NAME,
                job_extra_directives=list(executor.options),
                worker_extra_args=["--no-dashboard"],
                log_directory=str(folder),
                security=_certificates(folder),
                protocol="tls://",
                scheduler_options={"dashboard_address": None},
                silence_logs=logging.CRITICAL,
            )
    except (OSError, ValueError, RuntimeError) as error:
        raise _refused(f"no scheduler for its jobs can begin here ({error})") from error


def _certificates(folder: Path) -> distributed.Security:
    """Make certificates for this command alone, in files of ``folder`` that nobody but this user may read."""
    made = distributed.Security.temporary()
    paths = {}
    for name in ("ca_file", "worker_cert", "worker_key"):
        paths[name] = folder / f"{name}.pem"
        with open(os.open(paths[name], os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as stream:
            stream.write(getattr(made, f"tls_{name}"))
    ca, cert, key = map(str, paths.values())
    ours = {
        f"tls_{role}_{part}": path
        for role in ("scheduler", "worker", "client")
        for part, path in (("cert", cert), ("key", key))
    }
    return distributed.Security(tls_ca_file=ca, require_encryption=True, **ours)


def _ask_whether_taken(script: str, path: Path) -> None:
    """Raise ClusterError where Slurm would not take a job of this script, whose words would be lost later."""
    durable.write_file(path, script.encode())
    code, told = _slurm("sbatch", "--test-only", str(path))
    if code != 0:
        reason = " ".join(told.split()).rpartition("sbatch: error: ")[2] or "no reason given"
        raise _refused(f"Slurm takes no such jobs ({reason}); see executor.partition, time, memory, cores, options")


@contextlib.contextmanager
def watched_jobs(
    cluster: dask_jobqueue.SLURMCluster,
    executor: SlurmExecutor,
    tell: Callable[[str], None],
    give_up: Callable[[str], None],
) -> Iterator[None]:
    """Watch the jobs: tell why none begins, replace those lost before they joined, give up if all end so."""
    ended = threading.Event()
    watch = Watch(cluster, executor, tell, give_up)

    def look_on() -> None:
        while not ended.wait(WATCH_S):
            if not watch.goes_on():
                return

    thread = threading.Thread(target=look_on, daemon=True)
    tell(f"Slurm has been asked for {count_of(executor.jobs, 'job')}; stages wait for the first")
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join(ASK_S)


class Watch:
    """Looks at the jobs now and then."""

    def __init__(
        self, cluster: Any, executor: SlurmExecutor, tell: Callable[[str], None], give_up: Callable[[str], None]
    ) -> None:
        self._folder = Path(cluster.security.tls_ca_file).parent
        self._cluster, self._tell, self._give_up = cluster, tell, give_up
        self._patience, self._began_s = executor.connect_s, time.monotonic()
        self._most, self._jobs = max(FUTILE, executor.jobs), executor.jobs
        self._waits = True
        self._reached: set[str] = set()
        self._missing: set[str] = set()
        self._futile = 0

    def goes_on(self) -> bool:
        """Look once; False where it is given up."""
        submitted = {name: str(job.job_id) for name, job in list(self._cluster.workers.items()) if job.job_id}
        waiting = queued()
        if waiting is None:
            return True
        here = {str(worker["name"]) for worker in list(self._cluster.scheduler_info["workers"].values())}
        if here - self._reached:
            self._waits, self._futile = False, 0
        self._reached |= here
        gone = {name for name, job in submitted.items() if name not in self._reached and job not in waiting}
        lost = gone & self._missing  # twice in a row: it may have been on its way
        self._missing = gone - lost
        self._futile += len(lost)
        if self._futile >= self._most:
            self._give_up(self._why(submitted[max(lost)]))
            return False
        if lost:
            self._cluster.sync(self._cluster.scale_down, list(lost))
        if self._waits and time.monotonic() - self._began_s > self._patience:
            self._waits = False
            states = ", ".join(f"{job} {waiting[job]}" for job in sorted(submitted.values()) if job in waiting)
            self._tell(
                f"after {self._patience:g} s none of {count_of(self._jobs, 'job')} has begun ({states}); stages wait on"
            )
        return True

    def _why(self, job: str) -> str:
        with contextlib.suppress(OSError):
            printed = (self._folder / f"{JOB_NAME}-{job}.err").read_text(errors="replace").splitlines()
            lines = [line.strip() for line in printed if line.strip()]
            telling = [line for line in lines if "rror" in line] or lines
            if telling:
                return f"{self._futile} jobs of Slurm ended before they computed; the last one printed: {telling[-1]}"
        return (
            f"{self._futile} jobs of Slurm ended before they computed, and printed nothing: the nodes must see the "
            f"home ({self._folder.parents[1]}) and the Python {sys.executable}"
        )


def queued() -> dict[str, str] | None:
    """List this user's jobs in Slurm, each with its state; None if it cannot be asked now."""
    name = getpass.getuser()
    code, told = _slurm("squeue", "--noheader", f"--user={name}", f"--name={JOB_NAME}", "--format=%i|%T|%r")
    if code != 0:
        return None
    rows = [line.strip().split("|") for line in told.splitlines() if line.count("|") == 2]
    return {job: state if reason == "None" else f"{state}: {reason}" for job, state, reason in rows}


def _slurm(*command: str) -> tuple[int, str]:
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=ASK_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        return 1, str(error)
    return done.returncode, done.stdout + done.stderr


def _refused(message: str) -> ClusterError:
    return ClusterError("slurm", f"executor=slurm: {message}")
