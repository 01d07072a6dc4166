"""How a worker process comes to be: a new interpreter, or a fork of a server that has the stage imported already."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping
from typing import Any, Protocol

from kendama_cli.errors import StageError


def one_thread() -> dict[str, str]:
    """The environment of a worker: linear algebra on one thread.

    Its sums would otherwise be cut by the number of cores and round differently from machine to machine; and threads
    that wait for each other make the small systems here many times slower on a busy machine.
    """
    return {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


class Worker(Protocol):
    """A process that runs one stage."""

    def send_signal(self, number: int) -> None:
        """Send it a signal."""

    def kill(self) -> None:
        """End it at once."""

    def wait(self, timeout: float | None = None) -> int:
        """Its exit code, negative for a signal; raises subprocess.TimeoutExpired."""


class Interpreters:
    """Every worker is an interpreter of its own: it costs the stage's imports, and shares nothing."""

    def start(self, request: Mapping[str, Any], *, events: int, lock: int, printed: int) -> Worker:
        """Start a worker for ``request``; it inherits the three file descriptors, which stay open here too."""
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "kendama_cli.pipeline.worker"],
            stdin=subprocess.PIPE,
            stdout=printed,
            stderr=printed,
            pass_fds=(events, lock),
            env=one_thread(),
        )
        assert process.stdin is not None
        # the death of one that died at once is seen when its end of the events closes
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(json.dumps({**request, "events": events}).encode())
            process.stdin.close()
        return process

    def close(self) -> None:
        """Nothing is kept between workers."""


class ForkServer:
    """Workers are forks of one process, so that a sweep pays for a stage's imports once; one worker at a time."""

    def __init__(self) -> None:
        self._line, self._process = self._open()

    def start(self, request: Mapping[str, Any], *, events: int, lock: int, printed: int) -> Worker:
        """Have a worker forked for ``request``; a fork server that was killed is opened anew."""
        pid = self._ask(request, [events, lock, printed])
        if pid is None:
            self.close()
            self._line, self._process = self._open()
            pid = self._ask(request, [events, lock, printed])
        if pid is None:
            raise StageError("the process that starts the sweep's workers cannot run; begin the sweep again with -j 1")
        return _Fork(self._line, pid)

    def close(self) -> None:
        """End the fork server."""
        self._line.close()
        self._process.wait()

    def _ask(self, request: Mapping[str, Any], handles: list[int]) -> int | None:
        try:
            socket.send_fds(self._line, [json.dumps(request).encode()], handles)
            answer = self._line.recv(4096)
        except OSError:
            return None
        return int(json.loads(answer)["pid"]) if answer else None

    @staticmethod
    def _open() -> tuple[socket.socket, subprocess.Popen[bytes]]:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            command = [sys.executable, "-P", "-m", "kendama_cli.pipeline.forkserver", str(theirs.fileno())]
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, pass_fds=(theirs.fileno(),), env=one_thread())
            return ours, process


class _Fork:
    """A worker that the fork server forked: it is the fork server's child, so its exit code comes over the line."""

    def __init__(self, line: socket.socket, pid: int) -> None:
        self._line = line
        self._pid = pid
        self._code: int | None = None

    def send_signal(self, number: int) -> None:
        """Send it a signal."""
        if self._code is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self._pid, number)

    def kill(self) -> None:
        """End it at once."""
        self.send_signal(signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int:
        """Its exit code, negative for a signal; raises subprocess.TimeoutExpired."""
        if self._code is None:
            self._line.settimeout(timeout)
            try:
                answer = self._line.recv(4096)
            except TimeoutError:
                raise subprocess.TimeoutExpired(["forkserver"], timeout or 0.0) from None
            finally:
                self._line.settimeout(None)
            self._code = int(json.loads(answer)["code"]) if answer else -signal.SIGKILL
        return self._code
