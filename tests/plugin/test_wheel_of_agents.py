"""Agents of others, ``examples/agents``: as a wheel in a new environment one drives the twin, and its code counts."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from tests import warm_command
from tests.documented_package import copy_example, install_example, new_environment, wheel_of
from tests.plugin.test_wheel_of_parts import kendama

BRIEF = [
    "simulation/engine=rail",
    "learn/task=easy",
    "learn/learner=agent",
    "learn.learner.agent.kind=linear",
    "hardware=twin",
    "learn.learner.actions=continuous",
    "learn.count.max_rollouts=30",
    "learn.learner.validation_rollouts=10",
    "learn.count.evaluation_rollouts=5",
    "transfer.evaluation_rollouts=1",
    "transfer.max_rollouts=10",
    "transfer.games=1",
]


@pytest.fixture(scope="module")
def laboratory(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ``venv/``, which has our wheel and the agents'."""
    folder, source = tmp_path_factory.mktemp("laboratory"), tmp_path_factory.mktemp("source")
    copy_example("agents", source)
    new_environment(folder / "venv", wheel, wheel_of(source, folder))
    return folder


@pytest.mark.slow  # kernels are compiled for a new environment
def test_an_agent_of_a_wheel_drives_the_twin(laboratory: Path) -> None:
    done = kendama(laboratory, "run", "-p", "swingup", "--json", *BRIEF, timeout_s=1200)
    assert done.returncode == 0, done.stderr
    learn, transfer = json.loads(done.stdout)["stages"]
    assert learn["metrics"]["rollouts"] == 30
    assert transfer["metrics"]["rollouts"] >= 1


def test_its_code_and_its_name_count_for_the_result(tmp_path: Path) -> None:
    install_example("agents", tmp_path)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "KENDAMA_HOME": str(tmp_path / "home")}

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return warm_command.kendama(words, tmp_path, environment, 240, libraries=True)

    learned = ("run", "-p", "swingup", "--until", "learn", "--json", *BRIEF)
    done, again = run(*learned), run(*learned)
    assert done.returncode == 0, done.stderr
    assert {stage["status"] for stage in json.loads(again.stdout)["stages"]} == {"cached"}
    with (tmp_path / "lab_agents/linear.py").open("a") as file:
        file.write("\nNEW = 1\n")
    planned = run("plan", "-p", "swingup", *BRIEF)
    assert "lab_agents/linear.py" in planned.stdout
    other = run("run", "-p", "swingup", *BRIEF, "learn.learner.agent.kind=nobody")
    assert other.returncode == 2
    assert "'learn.learner.agent.kind' is 'nobody'; " in other.stderr
