"""Workers that are forks of one process which has their stage imported already; on Linux only."""

from __future__ import annotations

import contextlib
import functools
import gc
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from typing import IO, Any, TypeVar

from kendama_cli.errors import StageError
from kendama_cli.system.interface import Lock, Worker
from kendama_cli.system.interpreters import one_thread

FORK_SERVER = "kendama_cli.pipeline.forkserver"
"""The module that is the fork server's program; it calls ``serve``."""

R = TypeVar("R")


class ForkServer:
    """Workers are forks of one process, so that a sweep pays for a stage's imports once; one worker at a time."""

    def __init__(self) -> None:
        self._open()

    def start(self, request: Mapping[str, Any], *, lock: Lock, printed: int) -> Worker:
        """Have a worker forked that inherits ``lock``; a fork server that was killed is opened anew."""
        read, write = os.pipe()
        events = os.fdopen(read, "rb")
        # in a file that has no name: a message on the line holds some 200 kB, a request for many recordings more
        with tempfile.TemporaryFile() as asked, os.fdopen(write, "wb"):
            asked.write(json.dumps(request).encode())
            asked.flush()
            handles = [asked.fileno(), write, printed, *lock.inherited]
            try:
                try:
                    pid = self._ask(handles)
                except OSError:
                    self.close()
                    self._open()
                    pid = self._ask(handles)
            except OSError as error:
                events.close()
                raise StageError(f"the process that starts the sweep's workers ended: {self._reason(error)}") from error
        return _Fork(self._line, pid, events)

    def close(self) -> None:
        """End the fork server."""
        self._line.close()
        self._process.wait()
        self._printed.close()

    def _ask(self, handles: list[int]) -> int:
        """Return the process id of a new worker; raises OSError where the fork server does not answer."""
        socket.send_fds(self._line, [b"?"], handles)
        answer = self._line.recv(4096)
        if not answer:
            raise ConnectionResetError(f"exit code {self._process.wait()}")
        return int(json.loads(answer)["pid"])

    def _reason(self, error: OSError) -> str:
        """Return the last line that the fork server printed, or ``error`` where it printed nothing."""
        if self._printed.closed:
            return str(error)
        self._printed.seek(0)
        return (self._printed.read().decode(errors="replace").strip().splitlines() or [str(error)])[-1]

    def _open(self) -> None:
        self._line, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._printed = tempfile.TemporaryFile()  # noqa: SIM115 - open as long as the process
        command = [sys.executable, "-P", "-m", FORK_SERVER, str(theirs.fileno())]
        with theirs:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stderr=self._printed,
                pass_fds=(theirs.fileno(),),
                env=one_thread(),
            )


class _Fork:
    """A worker that the fork server forked: it is the fork server's child, so its exit code comes over the line."""

    def __init__(self, line: socket.socket, pid: int, events: IO[bytes]) -> None:
        self.events = events
        self._line = line
        self._pid = pid
        self._code: int | None = None

    def ask_to_end(self) -> None:
        """Send SIGTERM."""
        self._send(signal.SIGTERM)

    def kill(self) -> None:
        """End it at once."""
        self._send(signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its exit code, negative for a signal; raises subprocess.TimeoutExpired."""
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

    def _send(self, number: int) -> None:
        if self._code is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self._pid, number)


def serve(
    descriptor: int, prepare: Callable[[Mapping[str, Any]], R], work: Callable[[Mapping[str, Any], int, R], int]
) -> None:
    """Fork a worker for each request on the socket ``descriptor``, until its other end closes.

    A request is a file whose descriptor comes with those of its events, its printed output and its lock. ``prepare``
    is called here, ``work`` in the fork, with the request, the events' descriptor and the result of ``prepare``; the
    answers are its pid and, later, exit code.
    """
    line = socket.socket(fileno=descriptor)
    while True:
        asked, handles, _, _ = socket.recv_fds(line, 1, 4)
        if not asked:
            return
        with os.fdopen(handles.pop(0), "rb") as file:
            file.seek(0)
            request = json.loads(file.read())
        prepared = prepare(request)
        gc.freeze()  # else a fork's first collection copies every page that holds an object
        pid = os.fork()
        if pid == 0:
            line.close()
            os._exit(_be_worker(functools.partial(work, request, handles[0], prepared), handles[1]))
        for handle in handles:
            os.close(handle)
        line.send(json.dumps({"pid": pid}).encode())
        _, status = os.waitpid(pid, 0)
        line.send(json.dumps({"code": os.waitstatus_to_exitcode(status)}).encode())


def _be_worker(work: Callable[[], int], printed: int) -> int:
    os.dup2(printed, sys.stdout.fileno())
    os.dup2(printed, sys.stderr.fileno())
    try:
        return work()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
