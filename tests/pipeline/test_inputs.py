from __future__ import annotations

import importlib.metadata
from dataclasses import dataclass
from pathlib import Path

import pytest

from kendama_cli.errors import ConfigError, MissingPartError
from kendama_cli.pipeline.code import FileIndex
from kendama_cli.pipeline.inputs import describe, resolve_files
from kendama_cli.schema.settings import setting
from tests.extras import require_robot_descriptions


@dataclass(frozen=True)
class Described:
    path: str = setting("a file", file=True)


def resolved(path: str) -> str:
    found: Described = resolve_files(Described(path), "robot", [Path("/nowhere")])
    return found.path


def test_a_robot_of_the_extra_is_found_where_it_is_installed() -> None:
    require_robot_descriptions()
    found = Path(resolved("package://example-robot-data/ur_description/urdf/ur10_robot.urdf"))
    assert found.is_file()
    assert found.name == "ur10_robot.urdf"


def test_without_the_extra_one_line_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "distribution", missing)
    with pytest.raises(MissingPartError, match=r"robot\.path: .* pip install '\.\[robots\]' in a checkout") as caught:
        resolved("package://example-robot-data/ur_description/urdf/ur10_robot.urdf")
    assert caught.value.part == "example-robot-data"
    assert "\n" not in str(caught.value)


def test_other_packages_are_refused_with_the_one_that_is_known() -> None:
    with pytest.raises(ConfigError, match=r"in the package 'my_arm'; allowed: package://example-robot-data/\.\.\."):
        resolved("package://my_arm/urdf/arm.urdf")


def test_a_robot_that_the_extra_does_not_have_is_named() -> None:
    require_robot_descriptions()
    with pytest.raises(ConfigError, match=r"robot\.path: no such file 'package://example-robot-data/r2d2\.urdf'"):
        resolved("package://example-robot-data/r2d2.urdf")


@pytest.mark.parametrize("changed", ["000.png", "times.csv", "gone.png"])
def test_the_images_of_a_list_count_like_the_list_itself(tmp_path: Path, changed: str) -> None:
    (tmp_path / "times.csv").write_text("file,t_s\n000.png,0.0\ngone.png,0.1\n")
    (tmp_path / "000.png").write_bytes(b"one image")

    def key() -> list[str]:
        described = describe(Described(str(tmp_path / "times.csv")), FileIndex(tmp_path / "index.json"))
        return list(described["path"])

    before = key()
    assert key() == before
    assert [text.split()[0] for text in before] == ["times.csv", "000.png"]
    (tmp_path / changed).write_bytes(b"file,t_s\n000.png,0.5\n")
    assert key() != before


def test_other_tables_count_alone(tmp_path: Path) -> None:
    index = FileIndex(tmp_path / "index.json")
    for content in (b"t,x\n0,1\n", bytes(range(256)), b""):
        (tmp_path / "table.csv").write_bytes(content)
        assert len(describe(Described(str(tmp_path / "table.csv")), index)["path"]) == 1
