"""A Slurm of one node on this machine, for tests that may kill its parts: Debian's packages, munge, and root."""

from __future__ import annotations

import os
import platform
import shutil
import signal
import subprocess
import time
from pathlib import Path

from tests.toy_project import ToyProject

NEEDED = ("slurmctld", "slurmd", "sbatch", "squeue", "munged", "munge")
START_S = 60.0
CONFIGURATION = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CryptoType=crypto/munge
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SlurmctldPort=17817
SlurmdPort=17818
SlurmctldPidFile={state}/slurmctld.pid
SlurmdPidFile={state}/slurmd.pid
StateSaveLocation={state}/ctld
SlurmdSpoolDir={state}/d
SlurmctldLogFile={state}/slurmctld.log
SlurmdLogFile={state}/slurmd.log
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
ReturnToService=2
KillWait=5
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory=2000 State=UNKNOWN
PartitionName=debug Nodes=ALL Default=YES MaxTime=INFINITE State=UP OverSubscribe=FORCE:8
"""


def why_no_slurm() -> str | None:
    """Why no Slurm can be begun here; None where one can."""
    missing = [name for name in NEEDED if shutil.which(name, path=_path()) is None]
    if missing:
        return f"no {missing[0]}: apt-get install slurmctld slurmd slurm-client munge"
    if os.geteuid() != 0:
        return "Slurm and munge are begun as root"
    return None


def _path() -> str:
    return f"{os.environ.get('PATH', '')}{os.pathsep}/usr/sbin{os.pathsep}/usr/bin"


class SlurmProcesses:
    """slurmctld, slurmd, and munged where none runs; a context manager."""

    def __init__(self, state: Path) -> None:
        self._state = state
        self.environment = {**os.environ, "PATH": _path(), "SLURM_CONF": str(state / "slurm.conf")}

    def __enter__(self) -> SlurmProcesses:
        self._munged()
        for name in ("ctld", "d"):
            (self._state / name).mkdir()
        host, cpus = platform.node().partition(".")[0], os.cpu_count()
        (self._state / "slurm.conf").write_text(CONFIGURATION.format(host=host, state=self._state, cpus=cpus))
        self.slurm("slurmctld")
        self.begin_node_daemon()
        return self

    def __exit__(self, *error: object) -> None:
        for job in self.jobs():
            self.slurm("scancel", job)
        for name in ("slurmd", "slurmctld"):
            os.kill(int((self._state / f"{name}.pid").read_text()), signal.SIGTERM)

    def slurm(self, *command: str) -> str:
        """What a command of Slurm's prints."""
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=60, check=False)
        return done.stdout

    def jobs(self) -> list[str]:
        """The jobs that there are."""
        return self.slurm("squeue", "--noheader", "--format=%i").split()

    def kill_node_daemon(self) -> None:
        """SIGKILL to slurmd."""
        os.kill(int((self._state / "slurmd.pid").read_text()), signal.SIGKILL)

    def begin_node_daemon(self) -> None:
        """Begin slurmd, and wait until its node takes jobs."""
        self.slurm("slurmd")
        self._wait("slurmd", "sinfo", "--noheader", "--format=%t", ends=("idle", "mix", "alloc"))

    def start(self, toy: ToyProject, *overrides: str) -> subprocess.Popen[str]:
        """Start a sweep in two jobs, and leave it running."""
        (toy.folder / "shared").mkdir(exist_ok=True)
        where = (f"store.remote={toy.folder / 'shared'}", f"executor.workers_home={toy.folder / 'workers'}")
        jobs = ("executor.jobs=2", "executor.memory=500MB", "executor.interface=lo")
        command = toy.command("sweep", "-p", "toy", "--json", "--on", "slurm", *where, *jobs, *overrides)
        environment = {**toy.environment(), **self.environment, "PYTHONPATH": str(toy.folder / "lib")}
        pipe = subprocess.PIPE
        return subprocess.Popen(command, cwd=toy.folder, env=environment, stdout=pipe, stderr=pipe, text=True)

    def _munged(self) -> None:
        """Have munge answer, which is the machine's own and stays."""
        if subprocess.run(["munge", "-n"], env=self.environment, capture_output=True, check=False).returncode == 0:
            return
        key, place = Path("/etc/munge/munge.key"), Path("/run/munge")
        place.mkdir(exist_ok=True)
        if not key.exists():
            key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        for path in (key, place):
            shutil.chown(path, "munge", "munge")
        subprocess.run(["runuser", "-u", "munge", "--", "munged"], env=self.environment, check=True)
        self._wait("munged", "munge", "-n", ends=("MUNGE",))

    def _wait(self, what: str, *command: str, ends: tuple[str, ...]) -> None:
        deadline = time.monotonic() + START_S
        while not self.slurm(*command).startswith(ends):
            assert time.monotonic() < deadline, f"{what} does not answer"
            time.sleep(0.1)
