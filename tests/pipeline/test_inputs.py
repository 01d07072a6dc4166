from __future__ import annotations

import importlib.metadata
import re
from dataclasses import dataclass
from pathlib import Path

import pytest

from kendama_cli.errors import ConfigError, InputError, MissingPartError
from kendama_cli.pipeline.code import FileIndex
from kendama_cli.pipeline.inputs import describe, file_contents, resolve_files
from kendama_cli.pipeline.record import StageOutcome, begin
from kendama_cli.schema.settings import setting
from tests.extras import require_robot_descriptions


@dataclass(frozen=True)
class Described:
    path: str = setting("a file", file=True)


@dataclass(frozen=True)
class Listing:
    path: str = setting("a list of images", file=True, lists_images=True)


@dataclass(frozen=True)
class Logged:
    path: str = setting("a log", file=True, log=True)


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


def test_a_log_is_a_file_or_the_stage_of_a_run(tmp_path: Path) -> None:
    home, (folder, other) = tmp_path / "home", (tmp_path / "stored", tmp_path / "other")
    for one in (folder, other):
        one.mkdir()
        (one / "log.mcap").touch()
    record = begin(home, "perform", [])
    record.stages.append(StageOutcome("transfer", "transfer", "key", "ran", 1.0, str(folder), {}))
    record.save()

    def path(place: str) -> str:
        found: Logged = resolve_files(Logged(place), "transfer", [tmp_path], home)
        return found.path

    assert path(f"{record.run}/transfer") == path("1/transfer") == str(folder / "log.mcap")
    assert path("other/log.mcap") == path(str(other / "log.mcap")) == str(other / "log.mcap")
    for place, says in (
        ("1", "'1' is no log: name the stage too: transfer.path=1/STAGE"),
        ("7/transfer", "no run '7'; the newest is 1"),
        ("1/learn", f"run {record.run} has no stage 'learn'; it has: transfer"),
        ("gone.mcap", "transfer.path: no such file 'gone.mcap'"),
    ):
        with pytest.raises(ConfigError, match=re.escape(says)) as caught:
            path(place)
        assert caught.value.key == "transfer.path"


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
        described = describe(Listing(str(tmp_path / "times.csv")), FileIndex(tmp_path / "index.json"))
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
        assert len(describe(Listing(str(tmp_path / "table.csv")), index)["path"]) == 1


NAMES = (
    "../secret",
    "a/../../secret",
    "..",
    "{there}/secret",
    "link",
    "linked/secret",
    "..\\secret",
    "C:\\secret",
    "\\secret",
)


@pytest.mark.parametrize("name", [*NAMES, "a\0b", "circle"])
def test_a_list_of_images_names_no_file_beyond_its_folder(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "images"
    folder.mkdir()
    (tmp_path / "secret").write_text("of somebody else")
    (folder / "link").symlink_to(tmp_path / "secret")
    (folder / "linked").symlink_to(tmp_path)
    (folder / "circle").symlink_to(folder / "circle")
    (folder / "000.png").write_bytes(b"one image")
    table = folder / "times.csv"
    table.write_text(f"file,t_s\n000.png,0\n{name.format(there=tmp_path)},0.1\n")
    index = FileIndex(tmp_path / "index.json")
    for reads in (describe, file_contents):
        with pytest.raises(InputError, match=rf"{table}, row 3: .* is no file below {folder}; name files") as caught:
            reads(Listing(str(table)), index)
        assert len(str(caught.value).splitlines()) == 1
    assert str(tmp_path / "secret") not in index.read
    assert list(file_contents(Described(str(table)), index)) == [str(table)], "no list of images: nobody looks at it"


def test_images_below_the_folder_of_a_list_are_taken_however_it_is_reached(tmp_path: Path) -> None:
    (tmp_path / "disk/left").mkdir(parents=True)
    (tmp_path / "disk/left/0.png").write_bytes(b"one")
    (tmp_path / "disk/times.csv").write_text("file,t_s\nleft/0.png,0\n./left/0.png,1\n")
    (tmp_path / "here").symlink_to(tmp_path / "disk")
    named = file_contents(Listing(str(tmp_path / "here/times.csv")), FileIndex(tmp_path / "index.json"))
    assert [Path(path).name for path in named] == ["times.csv", "0.png"]


@pytest.mark.parametrize("spoil", ["../else.db3", "{there}/else.db3", "link"])
def test_a_bag_takes_no_file_beyond_its_folder(tmp_path: Path, spoil: str) -> None:
    (tmp_path / "bag").mkdir()
    facts = tmp_path / "bag/metadata.yaml"
    (tmp_path / "bag/0.db3").write_bytes(b"rows")
    (tmp_path / "else.db3").write_bytes(b"of somebody else")
    text = "rosbag2_bagfile_information:\n  relative_file_paths: [0.db3, '{}']\n"
    facts.write_text(text.format("0.db3"))
    index = FileIndex(tmp_path / "index.json")
    assert {Path(path).name for path in file_contents(Described(str(facts)), index)} == {"metadata.yaml", "0.db3"}
    if spoil == "link":
        (tmp_path / "bag/link").symlink_to(tmp_path / "else.db3")
    else:
        facts.write_text(text.format(spoil.format(there=tmp_path)))
    for reads in (describe, file_contents):
        with pytest.raises(InputError, match="is no file below"):
            reads(Described(str(facts)), index)
    assert str(tmp_path / "else.db3") not in index.read
