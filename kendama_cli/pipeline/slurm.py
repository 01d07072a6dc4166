"""Jobs of a Slurm cluster as Dask workers, by ``dask-jobqueue``; the scheduler is this process's own."""

from __future__ import annotations

import contextlib
import logging
import shutil
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from kendama_cli.errors import ClusterError, MissingPartError
from kendama_cli.settings.executor import SlurmExecutor
from kendama_cli.store import durable

try:
    import dask_jobqueue
    import distributed
except ImportError as missing:
    raise MissingPartError(
        "dask-jobqueue", "executor=slurm needs Dask and dask-jobqueue: pip install 'kendama[dask]'"
    ) from missing


@contextlib.contextmanager
def slurm_jobs(executor: SlurmExecutor, home: Path) -> Iterator[Any]:
    """A cluster of ``executor.jobs`` jobs, each replaced where it ends, all ended at the end.

    The nodes must see ``home``: what the jobs print and the certificates of this command stand there meanwhile. Raises
    ClusterError where Slurm is not here, or refuses.
    """
    if shutil.which("sbatch") is None:
        raise ClusterError(
            "slurm", "executor=slurm: this machine has no 'sbatch'; begin on a login node of the cluster"
        )
    folder = durable.make_folder(home / "slurm")
    given = {"queue": executor.partition, "account": executor.account, "interface": executor.interface}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of options that it would like to have otherwise
            cluster = dask_jobqueue.SLURMCluster(
                **given,
                walltime=executor.time,
                memory=executor.memory,
                cores=executor.cores,
                processes=1,
                job_name="kendama",
                job_extra_directives=list(executor.options),
                log_directory=str(folder),
                security=distributed.Security.temporary(),
                protocol="tls://",
                shared_temp_directory=str(folder),
                scheduler_options={"dashboard_address": None},
                silence_logs=logging.CRITICAL,
            )
    except (OSError, ValueError, RuntimeError) as error:
        raise ClusterError("slurm", f"executor=slurm: no scheduler for its jobs can begin here ({error})") from error
    with cluster:
        # a job that its time limit or its node's death ended is followed by another
        cluster.adapt(minimum_jobs=executor.jobs, maximum_jobs=executor.jobs)
        yield cluster
