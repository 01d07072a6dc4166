"""The program that ``tests.warm_command`` forks commands from: one per line of its standard input.

A fork's workers are forks too, unless real ones are asked for: a stage's work is the same in them, and what starting an
interpreter costs is half of what a run of the toy project does.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import gc
import importlib
import json
import os
import runpy
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Mapping, Sequence
from importlib.metadata import entry_points
from pathlib import Path
from typing import IO, Any, NoReturn

import pydantic.type_adapter  # noqa: F401
import typer._adapters
import typer.main
from hydra.core.override_parser.overrides_parser import OverridesParser

import kendama_cli.cli.run_work
import kendama_cli.pipeline.report  # noqa: F401
from kendama_cli.cli import app
from kendama_cli.cli.main import main
from kendama_cli.config import hydra_compose
from kendama_cli.config.site import find_site
from kendama_cli.pipeline.worker import work
from kendama_cli.system.interface import Lock, Worker
from kendama_cli.system.interpreters import one_thread
from kendama_cli.system.linux import Linux


class ForkedWorkers:
    """A ``Starter`` whose workers are forks of the process that starts them."""

    def start(self, request: Mapping[str, Any], *, lock: Lock, printed: int) -> Worker:
        """See ``Starter``; the lock is inherited as every descriptor is."""
        read, write = os.pipe()
        pid = os.fork()
        if pid == 0:
            code = 1
            try:
                os.environ.update(one_thread())
                del sys.path[0]  # a worker does not import from the folder that the command runs in
                for number in (1, 2):
                    os.dup2(printed, number)
                code = work(json.loads(json.dumps(request)), write)
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(code)
        os.close(write)
        return ForkedWorker(pid, os.fdopen(read, "rb"))

    def close(self) -> None:
        """Nothing is kept between workers."""


class ForkedWorker:
    """See ``Worker``."""

    def __init__(self, pid: int, events: IO[bytes]) -> None:
        self.events = events
        self._pid = pid

    def ask_to_end(self) -> None:
        """By SIGTERM."""
        self._send(signal.SIGTERM)

    def kill(self) -> None:
        """End it at once."""
        self._send(signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int:
        """Its exit code, negative for a signal; raises subprocess.TimeoutExpired."""
        deadline_s = None if timeout is None else time.monotonic() + timeout
        while True:
            pid, status = os.waitpid(self._pid, 0 if deadline_s is None else os.WNOHANG)
            if pid:
                return os.waitstatus_to_exitcode(status)
            if deadline_s is not None and time.monotonic() > deadline_s:
                raise subprocess.TimeoutExpired(["worker"], timeout or 0.0)
            time.sleep(0.01)

    def _send(self, number: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._pid, number)


def be_command(asked: Mapping[str, Any]) -> int:
    """Carry out the command line that was asked for, in this process; its exit code."""
    os.chdir(asked["folder"])
    os.environ.clear()
    os.environ.update(asked["environment"])
    # a file that is changed twice within a second, at the same size, would be read from its first bytecode
    sys.dont_write_bytecode = bool(os.environ.get("PYTHONDONTWRITEBYTECODE"))
    path = [entry for entry in asked["environment"].get("PYTHONPATH", "").split(os.pathsep) if entry]
    sys.path[:0] = [asked["folder"], *path]
    for number, name in enumerate((os.devnull, asked["out"], asked["err"])):
        os.dup2(os.open(name, os.O_RDWR), number)
    if "program" in asked:
        return be_program(asked["program"])
    if not asked["real_workers"]:
        Linux.interpreters = lambda self: ForkedWorkers()  # type: ignore[method-assign]
    exec(asked["before"], {})
    return main(asked["arguments"])


def be_program(words: Sequence[str]) -> int:
    """Carry out ``python WORDS`` in this process, without options but ``-m``; its exit code."""
    sys.argv = [*words[1:]] if words[0] == "-m" else [*words]
    try:
        if words[0] == "-m":
            runpy.run_module(words[1], run_name="__main__", alter_sys=True)
        else:
            sys.path[0] = str(Path(words[0]).parent)
            runpy.run_path(words[0], run_name="__main__")
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    except Exception:
        traceback.print_exc()
        return 1
    return 0


def _end(code: int) -> NoReturn:
    """Exit as an interpreter does, but for freeing every module one by one."""
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def import_libraries() -> None:
    """Import every stage of ours with all that it computes with."""
    for point in entry_points(group="kendama.stages"):
        declaration = point.load()
        importlib.import_module(declaration.run.partition(":")[0])


def serve() -> None:
    """Import what every command imports, then fork a command for each line."""
    sys.path.insert(0, str(Path(__file__).parents[1]))  # some wheel of others brings a package 'tests' of its own
    from tests.once import share_compositions  # noqa: PLC0415 - commands do not import from this folder

    del sys.path[0]
    share_compositions(Path(sys.argv[1]))
    OverridesParser.create().parse_override("warm=1")
    typer.main.get_command = functools.cache(typer.main.get_command)  # from signatures, which do not change
    typer.main.get_command(app.app)
    for group in entry_points().groups:
        for point in entry_points(group=group) if group.startswith("kendama.") else ():
            point.load()
    hydra_compose.compose_with_hydra(find_site(), [])  # its files are kept
    if "libraries" in sys.argv:
        import_libraries()
    gc.collect()
    gc.freeze()  # else a fork's first collection copies every page that holds an object
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            _end(be_command(json.loads(line)))
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    serve()
