"""Help at 80 columns, the next steps that ``kendama`` alone names, and parts of the configuration."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml
from typer.main import get_command

from kendama_cli.cli.app import app
from tests.cli.typed import kendama, refused

SECTIONS = ["Run:", "Look:", "Record:", "Robots:", "Teach:", "Housekeeping:"]


def commands(command: Any, path: str = "kendama") -> dict[str, Any]:
    """Every command by its words."""
    if not hasattr(command, "commands"):
        return {path: command}
    context = typer.Context(command, info_name=path)
    found = {}
    for name in command.list_commands(context):
        found |= commands(command.get_command(context, name), f"{path} {name}")
    return found


COMMANDS = commands(get_command(app))


def test_the_commands_stand_in_sections_in_the_order_of_use_with_whole_summaries(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = kendama(capsys, "--help")
    assert code == 0
    assert [line for line in out.splitlines() if line in SECTIONS] == SECTIONS
    assert "Commands:" not in out
    assert "Others:" not in out
    assert "..." not in out.partition("Run:")[2]
    assert max(map(len, out.splitlines())) <= 80
    assert kendama(capsys, "-h")[1] == out


@pytest.mark.parametrize("path", COMMANDS)
def test_the_help_of_a_command_has_an_example_and_types_as_words(path: str) -> None:
    text = COMMANDS[path].get_help(typer.Context(COMMANDS[path], info_name=path))
    assert f"Example: {path}" in " ".join(text.split())
    assert "<list[" not in text


def test_kendama_alone_names_three_steps_that_fit_the_folder(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    swing = Path("data/demonstrations/swing-01.csv").absolute()
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("KENDAMA_HOME", raising=False)

    def steps() -> list[str]:
        code, out, _ = kendama(capsys)
        assert code == 0
        return [line.strip() for line in out.splitlines() if line.startswith("  kendama ")]

    assert steps() == ["kendama run -p imitation", "kendama play", "kendama explain adapt"]
    shutil.copy(swing, tmp_path / "my swing.csv")
    assert steps()[0] == "kendama run -p imitation 'capture.path=my swing.csv'"
    (tmp_path / ".kendama/runs").mkdir(parents=True)
    (tmp_path / ".kendama/runs/00007-abcdef.json").write_text("{}")
    assert steps() == ["kendama report", "kendama runs", "kendama plan 'capture.path=my swing.csv'"]
    (tmp_path / "my swing.csv").unlink()
    assert steps() == ["kendama report", "kendama runs", "kendama run robot=iiwa"]
    assert "the newest run, 7" in kendama(capsys)[1]


def test_a_part_of_the_configuration_is_printed_with_the_meaning_of_each_value(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    whole = yaml.safe_load(kendama(capsys, "config")[1])
    out = kendama(capsys, "config", "encode")[1]
    assert yaml.safe_load(out) == {"encode": whole["encode"]}
    assert "  # Number M of Gaussian basis functions per coordinate. More of them follow\n" in out
    learner = yaml.safe_load(kendama(capsys, "config", "learn/learner", "learn/learner=random_replay")[1])
    assert learner["learner"]["kind"] == "random_replay"
    assert kendama(capsys, "config", "learn.alpha", "learn.alpha=0.25")[1].endswith("\nalpha: 0.25\n")
    assert "did you mean 'learn.alpha'?" in refused(capsys, "config", "learn.alpah")


def test_the_help_imports_nothing_heavy() -> None:
    heavy = "{'numpy', 'hydra', 'yaml'}"
    code = f"import sys; from kendama_cli.cli.main import main; main([]); print({heavy} & {{*sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "set()"
