"""The process that forks a sweep's workers: it imports each stage once, then every worker starts in milliseconds.

It has no threads, and computes nothing itself, so that a fork is as good as a new interpreter.
"""

from __future__ import annotations

import contextlib
import signal
import sys
from collections.abc import Mapping
from typing import Any

import numpy.random  # noqa: F401 - numpy imports it when it is first asked for, which every worker would do again

from kendama_cli.errors import KendamaError
from kendama_cli.pipeline.record import versions
from kendama_cli.pipeline.worker import make_stage, work
from kendama_cli.system.choice import system
from kendama_cli.system.fork_server import serve


def main() -> int:
    """Serve until the other end of the socket closes."""
    system().end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    versions()  # looked up once for all workers
    serve(int(sys.argv[1]), _prepare, work)
    return 0


def _prepare(request: Mapping[str, Any]) -> None:
    with contextlib.suppress(ImportError, KendamaError):  # the worker meets it again, and reports it
        stage, _ = make_stage(request)
        if hasattr(stage, "prepare"):
            stage.prepare()


if __name__ == "__main__":
    sys.exit(main())
