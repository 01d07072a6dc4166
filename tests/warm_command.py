"""The ``kendama`` command, forked from a process that has imported the command line already.

What is imported is the same for every command, and a fourth of what most of them cost. A fork is a process like any
other: own folder, environment, modules and exit code. Tests of signals and of what is imported start interpreters.
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

SERVER = """
import json, os, sys
import kendama_cli.cli.parsed, kendama_cli.cli.run_work, kendama_cli.pipeline.forkserver
from hydra import compose, initialize_config_dir
from hydra.core.override_parser.overrides_parser import OverridesParser
OverridesParser.create().parse_override("warm=1")
for line in sys.stdin:
    asked = json.loads(line)
    child = os.fork()
    if child == 0:
        os.chdir(asked["folder"])
        os.environ.clear()
        os.environ.update(asked["environment"])
        path = [entry for entry in asked["environment"].get("PYTHONPATH", "").split(os.pathsep) if entry]
        sys.path[:0] = [asked["folder"], *path]
        for number, name in enumerate((os.devnull, asked["out"], asked["err"])):
            os.dup2(os.open(name, os.O_RDWR), number)
        from kendama_cli.cli.main import main
        sys.exit(main(asked["arguments"]))
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


@functools.cache
def _server() -> subprocess.Popen[str]:
    """Ends with this process, which closes its standard input."""
    command = [sys.executable, "-P", "-c", SERVER]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def kendama(
    arguments: Sequence[str], folder: Path, environment: Mapping[str, str], timeout_s: float
) -> subprocess.CompletedProcess[str]:
    """Run ``kendama ARGUMENTS`` in ``folder`` to its end."""
    server = _server()
    assert server.stdin is not None
    assert server.stdout is not None
    with tempfile.TemporaryDirectory() as place:
        out, err = Path(place, "out"), Path(place, "err")
        out.touch()
        err.touch()
        asked = {"arguments": arguments, "folder": str(folder), "environment": dict(environment)}
        server.stdin.write(json.dumps({**asked, "out": str(out), "err": str(err)}) + "\n")
        server.stdin.flush()
        if not select.select([server.stdout], [], [], timeout_s)[0]:
            server.kill()
            _server.cache_clear()
            raise subprocess.TimeoutExpired([*arguments], timeout_s)
        code = int(server.stdout.readline())
        return subprocess.CompletedProcess([*arguments], code, out.read_text(), err.read_text())
