"""The twin as a user starts it: a process of its own, with which another run plays when it is armed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests import warm_command

COMMAND = [sys.executable, "-m", "kendama_cli.cli.main"]
SHORT = [
    "transfer.games=1",
    "transfer.evaluation_rollouts=1",
    "transfer.max_rollouts=1",
    "transfer.observation.source=tracking",
]


@pytest.fixture
def twin(tmp_path: Path) -> Iterator[dict[str, Any]]:
    """A running twin: what it said of itself."""
    key = str(tmp_path / "robot.key")
    made = subprocess.run([*COMMAND, "robot", "key", key], capture_output=True, text=True, check=True)
    assert made.stdout == f"{key}\n"
    process = subprocess.Popen(
        [*COMMAND, "robot", "twin", "--key-file", key], cwd=tmp_path, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    yield json.loads(process.stdout.readline())
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=20) == 130


def play(twin: dict[str, Any], folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    where = ["hardware=command", f"hardware.port={twin['port']}", f"hardware.key_file={folder / 'robot.key'}"]
    # how the table was learned does not matter here
    quick = ["simulation/engine=rail", "learn/task=easy", "learn.count.evaluation_rollouts=1"]
    words = ["run", "-p", "swingup", *quick, *where, *SHORT, *options]
    return warm_command.kendama(words, folder, os.environ, 240, libraries=True)


@pytest.mark.parametrize("sessions", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_the_twin_serves_on_loopback_and_plays_only_with_who_is_armed(
    twin: dict[str, Any], tmp_path: Path, sessions: int
) -> None:
    assert twin["host"] == "127.0.0.1"
    refused = play(twin, tmp_path)
    assert refused.returncode == 2
    assert "add --arm" in refused.stderr
    for _ in range(sessions):  # every run is a new attempt, and the twin takes one session after another
        played = play(twin, tmp_path, "--arm", "--json")
        assert played.returncode == 0, played.stderr
        stages = {stage["name"]: stage for stage in json.loads(played.stdout)["stages"]}
        assert stages["transfer"]["status"] == "ran"
        assert stages["transfer"]["metrics"]["games"] == 1
