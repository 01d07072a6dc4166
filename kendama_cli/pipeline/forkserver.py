"""The process that forks a sweep's workers: it imports each stage once, then every worker starts in milliseconds.

It has no threads, and computes nothing itself, so that a fork is as good as a new interpreter.
"""

from __future__ import annotations

import contextlib
import signal
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

from kendama_cli.pipeline.record import versions
from kendama_cli.pipeline.worker import ReadyStage, make_stage, work
from kendama_cli.system.fork_server import serve
from kendama_cli.system.interface import system


def main() -> int:
    """Serve until the other end of the socket closes."""
    system().end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    # once for all workers
    versions()
    np.random.default_rng(0)
    serve(int(sys.argv[1]), _Stages().ready, work)
    return 0


class _Stages:
    """Each stage as it was requested last; requests of a sweep that differ in seed or inputs reuse it."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[Any, ReadyStage]] = {}

    def ready(self, request: Mapping[str, Any]) -> ReadyStage | None:
        """Return the stage of ``request``; None if its worker has to make it."""
        config = {**request["parts"]["config"], "seed": None}  # with the digests of files that a stage may read at once
        name, asked = request["stage"], [request["declared"], request["settings"], request.get("places"), config]
        if name in self._known and self._known[name][0] == asked:
            return self._known[name][1]
        ready = _prepared(request)
        if ready is None or ready.declaration.kind != "computes":  # what it has of a device, its worker opens itself
            return None
        self._known[name] = asked, ready
        return ready


def _prepared(request: Mapping[str, Any]) -> ReadyStage | None:
    with contextlib.suppress(Exception):  # the worker meets it again, and reports it
        ready = make_stage(request)
        if hasattr(ready.stage, "prepare"):
            ready.stage.prepare()
        return ready
    return None


if __name__ == "__main__":
    sys.exit(main())
