"""The table of what each part brings is what ``pyproject.toml`` declares.

``python -m tests.plugins.test_parts_table`` writes it.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from kendama_cli.schema.declaration import NODES, STAGES, find_stage
from kendama_cli.schema.registry import TABLE, comes_with, missing_part

ROOT = Path(__file__).resolve().parents[2]
PLUGINS = "kendama_cli.plugins."


def brought() -> dict[str, dict[str, list[str]]]:
    """Return what each part brings, by part and entry point group; the nodes of its stages too."""
    groups = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]
    found: dict[str, dict[str, set[str]]] = {}
    for group, points in groups.items():
        for name, target in points.items():
            if target.startswith(PLUGINS):
                of_part = found.setdefault(target.removeprefix(PLUGINS).partition(":")[0].partition(".")[0], {})
                of_part.setdefault(group, set()).add(name)
                if group == STAGES and (stage := find_stage(name)) is not None:
                    of_part.setdefault(NODES, set()).update(stage.settings)
    return {
        part: {group: sorted(names) for group, names in sorted(of_part.items())}
        for part, of_part in sorted(found.items())
    }


def test_the_table_says_what_is_declared() -> None:
    assert json.loads(TABLE.read_text()) == brought(), "write it again: python -m tests.plugins.test_parts_table"


def test_every_folder_of_a_part_brings_something() -> None:
    folders = {path.parent.name for path in (ROOT / "kendama_cli/plugins").glob("*/__init__.py")}
    assert folders - {"shared"} == set(brought())


@pytest.mark.parametrize(("what", "group", "name", "part"), [("hardware=franka", "kendama.robots", "franka", "franka")])
def test_what_is_missing_names_its_part(what: str, group: str, name: str, part: str) -> None:
    line = comes_with(what, group, name)
    assert line is not None
    assert line.startswith(f"{what} comes with the part {part}, ")
    assert missing_part(group, "nobody's") is None


if __name__ == "__main__":
    TABLE.write_text(json.dumps(brought(), indent=2) + "\n")
