"""A project of its own, with stages registered by entry point: small, quick, and able to misbehave on request.

``roll`` draws random numbers with checkpoints, ``total`` adds up what it is given. Used to test the caretaker without
the weight of the real stages, and as the proof that a project can bring stages of its own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

STAGES = '''
"""Toy stages."""
import os
import signal
import time

import numpy as np

from kendama_cli.artifacts.policy import Policy
from kendama_cli.errors import StageError
from kendama_cli.stages.interface import Made
from toy.messages import NumberMessage
from toy.numbers import SCALE


class Roll:
    def __init__(self, toy):
        self.toy = toy

    def run(self, given, ctx):
        rng = ctx.rng("dice")
        state = ctx.restore()
        rows = list(state["rows"]) if state else []
        while len(rows) < self.toy.steps:
            if self.toy.fail_at == len(rows):
                raise StageError(f"told to fail at {len(rows)}")
            if self.toy.kill_file and len(rows) == self.toy.steps // 2 and not os.path.exists(self.toy.kill_file):
                open(self.toy.kill_file, "w").close()
                os.kill(os.getpid(), signal.SIGKILL)
            if self.toy.count_file:
                with open(self.toy.count_file, "a") as stream:
                    stream.write("x")
            rows.append(float(rng.normal()) * SCALE)
            ctx.log.write("/roll/number", len(rows) * 0.1, NumberMessage(len(rows), rows[-1]))
            ctx.checkpoint(lambda: {"rows": np.array(rows)}, force=True)
            ctx.progress(len(rows), self.toy.steps, last=rows[-1])
            time.sleep(self.toy.pause_s)
        return Made(Policy.seal(np.array([rows]), "{}"), {
            "n": len(rows), "sum": sum(rows), "seen_nan": float("nan"),
            "blas_threads": int(os.environ["OPENBLAS_NUM_THREADS"]),
        })


class Total:
    def __init__(self, toy):
        self.toy = toy

    def run(self, given, ctx):
        return Made(Policy.seal(np.array([[given["roll"].q.sum()]]), "{}"), {"total": float(given["roll"].q.sum())})
'''

MESSAGES = '''
"""Toy messages."""
from dataclasses import dataclass


@dataclass(frozen=True)
class NumberMessage:
    index: int
    value: float


TOPICS = {"/roll/number": NumberMessage}
'''

SETTINGS = '''
"""Toy settings."""
from dataclasses import dataclass

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class ToySettings:
    steps: int = setting("how many numbers", at_least=1)
    pause_s: float = setting("between numbers [s]", at_least=0)
    fail_at: int = setting("fail at this number; -1 never")
    kill_file: str = setting("end by SIGKILL half way unless this file exists; empty: never")
    count_file: str = setting("append an x here for each number; empty: do not")
'''

CONF = "steps: 20\npause_s: 0.0\nfail_at: -1\nkill_file: ''\ncount_file: ''\n"

PIPELINE = """
overrides: ["+toy=default"]
stages:
  roll: {stage: toy_roll, config: [toy, seed]}
  total: {stage: toy_total, needs: [roll], config: [toy]}
"""

ENTRY_POINTS = """
[kendama.stages]
toy_roll = toy.stages:Roll
toy_total = toy.stages:Total
[kendama.settings]
toy = toy.settings:ToySettings
"""


class ToyProject:
    """The project in ``folder`` and the ``kendama`` command run in it as a user would."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        files = {
            "lib/toy/__init__.py": "",
            "lib/toy/stages.py": STAGES,
            "lib/toy/messages.py": MESSAGES,
            "lib/toy/settings.py": SETTINGS,
            "lib/toy/numbers.py": "SCALE = 1.0\n",
            "lib/toy-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: toy\nVersion: 1.0\n",
            "lib/toy-1.0.dist-info/entry_points.txt": ENTRY_POINTS,
            "conf/toy/default.yaml": CONF,
            "pipelines/toy.yaml": PIPELINE,
        }
        for name, content in files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content)

    @property
    def home(self) -> Path:
        return self.folder / ".kendama"

    def environment(self) -> dict[str, str]:
        return {**os.environ, "PYTHONPATH": str(self.folder / "lib"), "PYTHONDONTWRITEBYTECODE": "1"}

    def command(self, *arguments: str) -> list[str]:
        return [sys.executable, "-m", "kendama_cli.cli.main", *arguments]

    def kendama(self, *arguments: str, expect: int = 0) -> subprocess.CompletedProcess[str]:
        """Run ``kendama ARGUMENTS`` to its end and check its exit code."""
        done = subprocess.run(
            self.command(*arguments),
            cwd=self.folder,
            env=self.environment(),
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        assert done.returncode == expect, f"{arguments}: exit {done.returncode}\n{done.stdout}\n{done.stderr}"
        assert "Traceback" not in done.stderr
        return done

    def start(self, *arguments: str) -> subprocess.Popen[str]:
        """Start ``kendama ARGUMENTS`` and leave it running."""
        return subprocess.Popen(
            self.command(*arguments),
            cwd=self.folder,
            env=self.environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def run_json(self, *arguments: str, expect: int = 0) -> dict[str, Any]:
        """The document of ``kendama run -p toy --json``."""
        return dict(json.loads(self.kendama("run", "-p", "toy", "--json", *arguments, expect=expect).stdout))


def statuses(document: dict[str, Any]) -> dict[str, str]:
    """Stage name to status."""
    return {stage["name"]: stage["status"] for stage in document["stages"]}


def artifact_bytes(document: dict[str, Any]) -> dict[str, dict[str, bytes]]:
    """Every file of every artifact of a run."""
    return {
        stage["name"]: {file.name: file.read_bytes() for file in sorted(Path(stage["artifact"]).iterdir())}
        for stage in document["stages"]
    }
