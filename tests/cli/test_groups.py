"""Commands of packages: found by their entry points, imported where they are typed, told where they are missing."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from kendama_cli.cli.main import main
from kendama_cli.schema import registry
from tests.documented_package import declare_installed

COMMANDS = """
import typer

bench_app = typer.Typer(help="A bench.")


@bench_app.command("level")
def level(by_mm: float = 0.0) -> int:
    "Level the bench."
    print(f"levelled by {by_mm} mm")
    return 3


@bench_app.command("lift")
def lift() -> None:
    "Lift the bench."


def dust() -> None:
    "Dust the lens."
    print("dusted")
"""


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package with a group of commands, one command for a group of ours, and one that cannot be imported."""
    (tmp_path / "bench_commands.py").write_text(COMMANDS)
    entries = "lathe = bench_commands:bench_app\ncamera.dust = bench_commands:dust\nworn = bench_nowhere:app"
    declare_installed(tmp_path, "bench", {"kendama.commands": entries})
    monkeypatch.syspath_prepend(str(tmp_path))
    forget()
    yield tmp_path
    forget()
    sys.modules.pop("bench_commands", None)


def forget() -> None:
    """Have installed packages looked at again."""
    registry._entry_points.cache_clear()
    registry.declared.cache_clear()


def test_commands_of_a_package_are_carried_out_and_stand_in_the_help(
    bench: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(["lathe", "level", "--by-mm", "2"]) == 3
    assert main(["camera", "dust"]) == 0
    assert capfd.readouterr().out == "levelled by 2.0 mm\ndusted\n"
    assert main(["--help"]) == main(["camera", "--help"]) == main(["lathe", "-h"]) == 0
    shown = capfd.readouterr().out
    for line in ("lathe A bench.", "dust Dust the lens.", "level Level the bench."):
        assert line in " ".join(shown.split())


def test_a_command_of_ours_imports_no_package(bench: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["camera", "board", "--help"]) == 0
    assert "bench_commands" not in sys.modules


def test_a_broken_package_is_told_where_it_is_used_and_stops_no_help(
    bench: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(["--help"]) == 0
    assert "command 'worn' needs module 'bench_nowhere'" in " ".join(capfd.readouterr().out.split())
    assert main(["worn", "out", "--fast"]) == 2
    told = capfd.readouterr().err
    assert told == (
        "kendama: command 'worn' needs module 'bench_nowhere', which is not installed (bench_nowhere:app); "
        "'kendama doctor' says what brings it\n"
    )


def test_a_command_of_a_part_that_is_missing_names_the_part(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    table = tmp_path / "parts.json"
    table.write_text(json.dumps({"dentist": {"kendama.commands": ["camera.drill"]}}))
    monkeypatch.setattr(registry, "TABLE", table)
    assert main(["camera", "drill", "--deep"]) == 2
    assert capfd.readouterr().err == (
        "kendama: 'kendama camera drill' comes with the part dentist, which this installation lacks; "
        "install the whole of kendama-cli\n"
    )
    assert main(["camera", "dril"]) == 2
    assert "No such command 'dril'" in capfd.readouterr().err
