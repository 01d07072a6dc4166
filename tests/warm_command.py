"""The ``kendama`` command, forked from a process that has imported the command line and all declarations already.

What is imported is the same for every command, and a fourth of what most of them cost. A fork is a process like any
other: own folder, environment, modules and exit code. Tests of signals and of what is imported start interpreters.
``libraries``: of a process that has imported every stage too, with the libraries that compute; for what runs stages of
ours, where importing them is half of the work.
"""

from __future__ import annotations

import functools
import json
import select
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kendama_cli.system.interpreters import one_thread
from tests import alone

SERVER = Path(__file__).with_name("warm_server.py")


@functools.cache
def _server(*, libraries: bool) -> subprocess.Popen[str]:
    """Ends with this process, which closes its standard input."""
    command = [sys.executable, "-P", str(SERVER), str(alone.shared_folder() / "composed")]
    command += ["libraries"] if libraries else []
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=one_thread())


def kendama(
    arguments: Sequence[str],
    folder: Path,
    environment: Mapping[str, str],
    timeout_s: float,
    *,
    before: str = "",
    real_workers: bool = False,
    libraries: bool = False,
) -> subprocess.CompletedProcess[str]:
    """Run ``kendama ARGUMENTS`` in ``folder`` to its end, in a process that executes the code ``before`` first.

    ``real_workers``: its workers are interpreters, as the system starts them.
    """
    asked = {"arguments": arguments, "folder": str(folder), "environment": dict(environment), "before": before}
    return _ended({**asked, "real_workers": real_workers}, timeout_s, libraries=libraries)


def python(
    words: Sequence[str], folder: Path, environment: Mapping[str, str], timeout_s: float
) -> subprocess.CompletedProcess[str]:
    """Run ``python -m MODULE ...`` or ``python FILE ...`` in ``folder`` to its end, with all libraries imported."""
    asked = {"program": words, "folder": str(folder), "environment": dict(environment)}
    return _ended({"arguments": words, **asked}, timeout_s, libraries=True)


def _ended(asked: Mapping[str, Any], timeout_s: float, *, libraries: bool) -> subprocess.CompletedProcess[str]:
    server = _server(libraries=libraries)
    assert server.stdin is not None
    assert server.stdout is not None
    with tempfile.TemporaryDirectory() as place:
        out, err = Path(place, "out"), Path(place, "err")
        out.touch()
        err.touch()
        server.stdin.write(json.dumps({**asked, "out": str(out), "err": str(err)}) + "\n")
        server.stdin.flush()
        if not select.select([server.stdout], [], [], timeout_s)[0]:
            server.kill()
            _server.cache_clear()
            raise subprocess.TimeoutExpired([*asked["arguments"]], timeout_s)
        code = int(server.stdout.readline())
        return subprocess.CompletedProcess([*asked["arguments"]], code, out.read_text(), err.read_text())
