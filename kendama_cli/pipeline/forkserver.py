"""The process that forks a sweep's workers: it imports each stage once, then every worker starts in milliseconds.

A request comes over the socket with three file descriptors (events, lock, printed output); the answers are the
worker's pid and, when it has ended, its exit code. It has no threads, and computes nothing itself, so that a fork is
as good as a new interpreter.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import sys

from kendama_cli.errors import KendamaError
from kendama_cli.pipeline.worker import end_with_parent, make_stage, work

REQUEST_BYTES = 1 << 20


def main() -> int:
    """Serve until the other end of the socket closes."""
    end_with_parent(signal.SIGTERM)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    line = socket.socket(fileno=int(sys.argv[1]))
    line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, REQUEST_BYTES)
    while True:
        data, handles, _, _ = socket.recv_fds(line, REQUEST_BYTES, 3)
        if not data:
            return 0
        request = json.loads(data)
        with contextlib.suppress(ImportError, KendamaError):  # the worker meets it again, and tells
            stage, _ = make_stage(request)
            if hasattr(stage, "prepare"):
                stage.prepare()
        pid = os.fork()
        if pid == 0:
            os._exit(_be_worker(line, request, handles))
        for handle in handles:
            os.close(handle)
        line.send(json.dumps({"pid": pid}).encode())
        _, status = os.waitpid(pid, 0)
        line.send(json.dumps({"code": os.waitstatus_to_exitcode(status)}).encode())


def _be_worker(line: socket.socket, request: dict[str, object], handles: list[int]) -> int:
    line.close()
    events, _, printed = handles
    os.dup2(printed, sys.stdout.fileno())
    os.dup2(printed, sys.stderr.fileno())
    try:
        return work({**request, "events": events})
    finally:
        sys.stdout.flush()
        sys.stderr.flush()


if __name__ == "__main__":
    sys.exit(main())
