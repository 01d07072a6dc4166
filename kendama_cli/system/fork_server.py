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
from collections.abc import Callable, Mapping
from typing import IO, Any, TypeVar

from kendama_cli.errors import StageError
from kendama_cli.system.interface import Lock, Worker
from kendama_cli.system.interpreters import one_thread

FORK_SERVER = "kendama_cli.pipeline.forkserver"
"""The module that is the fork server's program; it calls ``serve``."""
REQUEST_BYTES = 1 << 20

R = TypeVar("R")


class ForkServer:
    """Workers are forks of one process, so that a sweep pays for a stage's imports once; one worker at a time."""

    def __init__(self) -> None:
        self._line, self._process = self._open()

    def start(self, request: Mapping[str, Any], *, lock: Lock, printed: int) -> Worker:
        """Have a worker forked that inherits ``lock``; a fork server that was killed is opened anew."""
        read, write = os.pipe()
        handles = [write, printed, *lock.inherited]
        pid = self._ask(request, handles)
        if pid is None:
            self.close()
            self._line, self._process = self._open()
            pid = self._ask(request, handles)
        os.close(write)
        events = os.fdopen(read, "rb")
        if pid is None:
            events.close()
            raise StageError("the process that starts the sweep's workers cannot run; begin the sweep again with -j 1")
        return _Fork(self._line, pid, events)

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
            command = [sys.executable, "-P", "-m", FORK_SERVER, str(theirs.fileno())]
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, pass_fds=(theirs.fileno(),), env=one_thread())
            return ours, process


class _Fork:
    """A worker that the fork server forked: it is the fork server's child, so its exit code comes over the line."""

    def __init__(self, line: socket.socket, pid: int, events: IO[bytes]) -> None:
        self.events = events
        self._line = line
        self._pid = pid
        self._code: int | None = None

    def ask_to_end(self) -> None:
        """By SIGTERM."""
        self._send(signal.SIGTERM)

    def kill(self) -> None:
        """End it at once."""
        self._send(signal.SIGKILL)

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

    def _send(self, number: int) -> None:
        if self._code is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self._pid, number)


def serve(
    descriptor: int, prepare: Callable[[Mapping[str, Any]], R], work: Callable[[Mapping[str, Any], int, R], int]
) -> None:
    """Fork a worker for each request on the socket ``descriptor``, until its other end closes.

    A request comes with the descriptors of its events, its printed output and its lock. ``prepare`` is called here,
    ``work`` in the fork, with the request, the events' descriptor and what ``prepare`` gave; the answers are its pid
    and, later, exit code.
    """
    line = socket.socket(fileno=descriptor)
    line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, REQUEST_BYTES)
    while True:
        data, handles, _, _ = socket.recv_fds(line, REQUEST_BYTES, 3)
        if not data:
            return
        request = json.loads(data)
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
