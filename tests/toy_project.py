"""A project of its own, with stages registered by entry point: small, quick, and able to misbehave on request.

``roll`` draws random numbers with checkpoints; its folder holds its declaration, artifact, messages, chapter and
settings. ``total`` adds up what it is given. Used to test runs without the weight of the real stages, and as the proof
that a project brings stages of its own with nothing outside their folders but values in ``conf/``.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests import warm_command

DECLARATION = '''
"""The stage toy_roll, declared."""
from kendama_cli.schema.declaration import Headline, StageDeclaration
from toy.roll.messages import TOPICS
from toy.roll.settings import ToySettings

STAGE = StageDeclaration(
    name="toy_roll",
    title="Rolled numbers",
    lead="Numbers are drawn one after the other.",
    run="toy.roll.stage:Roll",
    returns="toy.roll.artifact:Rolls",
    settings={"toy": ToySettings},
    topics=TOPICS,
    chapter="toy.roll.chapter:figures",
    headline=(Headline("sum", "is the sum of the numbers"),),
)
'''

ARTIFACT = '''
"""What toy_roll gives."""
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np


@dataclass(frozen=True)
class Fair:
    kind: Literal["fair"]


@dataclass(frozen=True)
class Loaded:
    kind: Literal["loaded"]
    side: int


@dataclass(frozen=True)
class Rolls:
    values: np.ndarray
    names: tuple[str, ...]
    die: Fair | Loaded
    counts: Mapping[str, int]
    largest: float | None
'''

STAGE = '''
"""Draws numbers, with checkpoints."""
import os
import signal
import time

import numpy as np

from kendama_cli.errors import StageError
from kendama_cli.stages.interface import StageResult
from toy.numbers import SCALE
from toy.roll.artifact import Fair, Loaded, Rolls
from toy.roll.messages import NumberMessage


class Roll:
    def __init__(self, toy):
        self.toy = toy

    def run(self, given, ctx):
        rng = ctx.rng("dice")
        state = ctx.restore()
        values = list(state["values"]) if state else []
        while len(values) < self.toy.steps:
            if self.toy.fail_at == len(values):
                raise StageError(f"told to fail at {len(values)}")
            if self.toy.kill_file and len(values) == self.toy.steps // 2 and not os.path.exists(self.toy.kill_file):
                open(self.toy.kill_file, "w").close()
                os.kill(os.getpid(), signal.SIGKILL)
            if self.toy.count_file:
                with open(self.toy.count_file, "a") as stream:
                    stream.write("x")
            values.append(float(rng.normal()) * SCALE)
            ctx.log.write("/roll/number", len(values) * 0.1, NumberMessage(len(values), values[-1]))
            ctx.checkpoint(lambda: {"values": np.array(values)}, force=True)
            ctx.progress(len(values), self.toy.steps, last=values[-1])
            time.sleep(self.toy.pause_s)
        die = Fair("fair") if SCALE == 1.0 else Loaded("loaded", 6)
        counts = {"below": sum(value < 0 for value in values), "above": sum(value >= 0 for value in values)}
        rolls = Rolls(np.array([values]), tuple(map(str, range(len(values)))), die, counts, max(values))
        return StageResult([1] if self.toy.gives_list else rolls, {
            "n": len(values), "sum": sum(values), "seen_nan": float("nan"),
            "blas_threads": int(os.environ["OPENBLAS_NUM_THREADS"]),
        })
'''

CHAPTER = '''
"""The report's chapter of toy_roll."""
from kendama_cli.report.figure import Figure, Panel
from toy.roll.messages import NumberMessage


def figures(log):
    if log.setting("toy", "fail_at", default=-1) == -2:
        raise KeyError("a field that older logs lack")
    n = len(log.table("/roll/number", NumberMessage))
    return [Figure("Every number that was drawn.", (Panel("Numbers", f"<b>{n} numbers</b>"),))]
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
    fail_at: int = setting("fail at this number; -1 never; -2 only where the chapter is drawn")
    kill_file: str = setting("end by SIGKILL half way unless this file exists; empty: never")
    count_file: str = setting("append an x here for each number; empty: do not")
    gives_list: bool = setting("give a list instead of what is declared")
'''

TOTAL = '''
"""The stage toy_total, its artifact and its declaration in one file: nothing asks for a folder."""
from dataclasses import dataclass

from kendama_cli.schema.declaration import StageDeclaration
from kendama_cli.stages.interface import StageResult


@dataclass(frozen=True)
class Sum:
    total: float


class Total:
    def __init__(self, toy):
        self.toy = toy

    def run(self, given, ctx):
        rolls = given["roll"]
        assert rolls.die.kind in ("fair", "loaded") and rolls.largest == rolls.values.max()
        assert sum(rolls.counts.values()) == len(rolls.names) == rolls.values.size
        total = float(rolls.values.sum())
        return StageResult(Sum(total), {"total": total})


STAGE = StageDeclaration(
    name="toy_total", title="Total", lead="", run="toy.total:Total", returns="toy.total:Sum", settings={}, topics={},
)
'''

CONFIG = "defaults: [_self_, {store: home}, {executor: local}]\nseed: 0\n"
"""A first file of the project's own: nothing is composed but what its stages read and every run needs."""

CONF = "steps: 20\npause_s: 0.0\nfail_at: -1\nkill_file: ''\ncount_file: ''\ngives_list: false\n"

PIPELINE = """
overrides: ["+toy=default"]
stages:
  roll: {stage: toy_roll, config: [toy, seed]}
  total: {stage: toy_total, needs: [roll], config: [toy]}
"""

ENTRY_POINTS = """
[kendama.stages]
toy_roll = toy.roll:STAGE
toy_total = toy.total:STAGE
"""


class ToyProject:
    """The project in ``folder`` and the ``kendama`` command run in it as a user would.

    Its configuration stands beside all of ours; ``alone``: it has a first file of its own, and takes none of ours.
    ``real_workers``: the workers of ``kendama`` are interpreters, as those of ``start`` always are.
    """

    def __init__(self, folder: Path, *, alone: bool = False, real_workers: bool = False) -> None:
        self.folder = folder
        self.real_workers = real_workers
        files = {
            "lib/toy/__init__.py": "",
            "lib/toy/roll/__init__.py": DECLARATION,
            "lib/toy/roll/artifact.py": ARTIFACT,
            "lib/toy/roll/chapter.py": CHAPTER,
            "lib/toy/roll/messages.py": MESSAGES,
            "lib/toy/roll/settings.py": SETTINGS,
            "lib/toy/roll/stage.py": STAGE,
            "lib/toy/total.py": TOTAL,
            "lib/toy/numbers.py": "SCALE = 1.0\n",
            "lib/toy-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: toy\nVersion: 1.0\n",
            "lib/toy-1.0.dist-info/entry_points.txt": ENTRY_POINTS,
            **({"conf/config.yaml": CONFIG} if alone else {}),
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
        """A user's: linear algebra on one thread is not this suite's doing."""
        user = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
        return {**user, "PYTHONPATH": str(self.folder / "lib"), "PYTHONDONTWRITEBYTECODE": "1"}

    def command(self, *arguments: str) -> list[str]:
        return [sys.executable, "-m", "kendama_cli.cli.main", *arguments]

    def kendama(self, *arguments: str, expect: int = 0) -> subprocess.CompletedProcess[str]:
        """Run ``kendama ARGUMENTS`` to its end and check its exit code."""
        # only a hang takes 240 s, on a busy machine too
        done = warm_command.kendama(arguments, self.folder, self.environment(), 240, real_workers=self.real_workers)
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
