"""Settings of the machines on which stages compute: Dask's and Slurm's."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class DaskExecutor:
    """The workers of a Dask scheduler."""

    kind: Literal["dask"]
    scheduler: str | None = setting(
        "Address of the scheduler, such as tls://host:8786; null starts a scheduler and workers on this machine."
    )
    tls_ca: str | None = setting("File of the authority that signed the cluster's certificates; null for no TLS.")
    tls_cert: str | None = setting("File of this machine's certificate; null for no TLS.")
    tls_key: str | None = setting("File of the certificate's private key; null for no TLS.")
    workers: int | None = setting(
        "Number of workers, if they are started on this machine; null starts one per core.", at_least=1
    )
    workers_home: str = setting("Folder on each worker's machine that holds the worker's own home.")
    connect_s: float = setting(
        "The scheduler counts as unreachable when it has not answered for this long [s].", above=0
    )

    def __post_init__(self) -> None:
        if self.scheduler is not None and not re.fullmatch(r"(tcp|tls)://[^/\s]+:\d+", self.scheduler):
            raise ConfigError("scheduler", f"'scheduler' is '{self.scheduler}'; allowed: tls://HOST:PORT, tcp://...")
        named = [name for name in ("tls_ca", "tls_cert", "tls_key") if getattr(self, name) is not None]
        if len(named) in (1, 2):
            missing = next(name for name in ("tls_ca", "tls_cert", "tls_key") if name not in named)
            raise ConfigError(missing, f"'{missing}' is null; allowed: a file, as '{named[0]}' is one")
        if self.scheduler is not None and self.scheduler.startswith("tls://") != bool(named):
            raise ConfigError(
                "scheduler",
                f"'scheduler' is '{self.scheduler}'; allowed: tls:// with tls_ca, tls_cert and tls_key, tcp:// without",
            )


@dataclass(frozen=True)
class SlurmExecutor:
    """Jobs of a Slurm cluster, each a Dask worker that ends with the command."""

    kind: Literal["slurm"]
    partition: str | None = setting("Partition of the jobs (sbatch -p); null takes Slurm's default.")
    account: str | None = setting("Account that the jobs are charged to (sbatch -A); null takes Slurm's default.")
    time: str = setting("Time limit of a job (sbatch -t). Work that it cuts short resumes in another job.")
    memory: str = setting("Memory of each job, such as 4GiB.")
    cores: int = setting("Number of cores of each job, which computes as many stages at once.", at_least=1)
    jobs: int = setting("Number of jobs.", at_least=1)
    interface: str | None = setting("Network interface by which the jobs reach this machine; null takes the usual one.")
    options: tuple[str, ...] = setting("Further options of sbatch, such as --qos=long.")
    workers_home: str = setting("Folder on each node that holds the worker's own home.")
    connect_s: float = setting("If no job has started after this time, the command reports that it waits [s].", above=0)

    def __post_init__(self) -> None:
        if not re.fullmatch(r"(\d+-)?\d+(:\d\d){0,2}", self.time):
            raise ConfigError("time", f"'time' is '{self.time}'; allowed: as sbatch has it, 01:30:00 or 2-00:00:00")
        if not re.fullmatch(r"\d+(\.\d+)? ?[KMGT]?i?B", self.memory):
            raise ConfigError("memory", f"'memory' is '{self.memory}'; allowed: a size such as 4GiB")
        for name in ("partition", "account", "interface"):  # they stand in a script
            value = getattr(self, name)
            if value is not None and not re.fullmatch(r"[\w.,:@+-]+", value):
                raise ConfigError(name, f"'{name}' is {value!r}; allowed: a name")
        for option in self.options:
            if not option.startswith("-") or "\n" in option:
                raise ConfigError(
                    "options", f"'options' holds {option!r}; allowed: options of sbatch, such as --qos=long"
                )
