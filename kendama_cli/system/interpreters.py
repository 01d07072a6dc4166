"""Workers that are interpreters of their own; they report through their standard output."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from typing import IO, Any

from kendama_cli.system.interface import Lock, Worker

WORKER = "kendama_cli.pipeline.worker"
"""The module that is a worker's program."""


def one_thread() -> dict[str, str]:
    """Return the environment of a worker: linear algebra on one thread.

    Its sums would otherwise be cut by the number of cores and round differently from machine to machine; and threads
    that wait for each other make the small systems here many times slower on a busy machine.
    """
    return {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


class Interpreters:
    """Starter of workers as interpreters; the request is the first line of a worker's standard input."""

    def __init__(self, *, ended_by_signal: bool) -> None:
        """Set how workers end: by a signal, or by closing their standard input."""
        self._ended_by_signal = ended_by_signal

    def start(self, request: Mapping[str, Any], *, lock: Lock, printed: int) -> Worker:
        """Start a worker that inherits ``lock``, where locks can be."""
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", WORKER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=printed,
            pass_fds=lock.inherited,
            env=one_thread(),
        )
        assert process.stdin is not None
        assert process.stdout is not None
        # the death of one that died at once is seen when its end of the events closes
        with contextlib.suppress(OSError):
            process.stdin.write(json.dumps(request).encode() + b"\n")
            process.stdin.flush()
        return _Interpreter(process, process.stdin, process.stdout, ended_by_signal=self._ended_by_signal)

    def close(self) -> None:
        """Do nothing: nothing is held between workers."""


class _Interpreter:
    """A child process of ours."""

    def __init__(
        self, process: subprocess.Popen[bytes], lifeline: IO[bytes], events: IO[bytes], *, ended_by_signal: bool
    ) -> None:
        self.events = events
        self._process = process
        self._lifeline = lifeline
        self._ended_by_signal = ended_by_signal

    def ask_to_end(self) -> None:
        """Send SIGTERM, or close its standard input."""
        if self._ended_by_signal:
            self._process.terminate()
        else:
            self._close()

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its exit code, negative for a signal; raises subprocess.TimeoutExpired."""
        code = self._process.wait(timeout)
        self._close()
        return code

    def _close(self) -> None:
        with contextlib.suppress(OSError):
            self._lifeline.close()
