"""A home is known by its mark or by records of ours; nothing of anybody else is written over or deleted."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from kendama_cli.errors import UsageError
from kendama_cli.schema.renames import SINCE
from kendama_cli.store import durable
from kendama_cli.store.garbage import collect_garbage, verify
from kendama_cli.store.home import MARK, claim
from kendama_cli.store.store import Store
from tests.toy_project import ToyProject

PROJECT = (
    "results/exp1/metrics.json",
    "results/learn/summary.json",
    f"results/learn/{'1' * 40}.json",
    "runs/00003-abcdef.json",
    "runs/summary.json",
    "runs/tensorboard/events.out",
    "runs/00001-abcdef/model.pt",
    "checkpoints/resnet/epoch1.pt",
    "checkpoints/resnet/epoch2/model.pt",
    f"checkpoints/resnet/{'a' * 40}/model.pt",
    "inputs/measured.csv",
    f"inputs/{'b' * 32}/measured.csv",
    "scratch/notes.txt",
    f"scratch/{'c' * 32}/notes.txt",
    "slurm/job.sh",
    "objects/ab/cd/file",
    f"objects/ab/{'ab' * 32}/weights.bin",
    "index/my.json",
    "index/latest/of/mine/x.json",
    "locks/mine.lock",
    "src/.scratch-notes",
    f"src/.scratch-{'d' * 32}/kept.py",
)
"""Files of a person, some in folders that are called as ours could be."""


def lay_out(folder: Path) -> dict[str, bytes]:
    for name in PROJECT:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(f'["of a person", "{name}"]')
    return files(folder)


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def a_result(home: Path) -> Store:
    store = Store(home)
    with store.scratch_folder() as folder:
        (folder / "artifact.json").write_text("{}")
        store.put(folder, "roll", "0" * 40, {"n": 1}, {})
    return store


@pytest.mark.parametrize(
    "command",
    [
        ("cache", "gc"),
        ("cache", "gc", "--dry-run", "--keep-runs", "0"),
        ("run", "-p", "toy"),
        ("plan", "-p", "toy"),
        ("sweep", "-p", "toy", "seed=1,2"),
        ("config", "+toy=default"),
        ("cache", "push", "--remote", "shared"),
        ("cache", "pull", "--remote", "shared"),
        ("docs", "--no-show"),
    ],
)
def test_a_folder_of_somebody_else_is_refused_and_left_as_it_is(toy: ToyProject, command: tuple[str, ...]) -> None:
    if command[0] == "docs":
        pytest.importorskip("sphinx")
    (toy.folder / "shared").mkdir()
    mine = toy.folder / "mine"
    before = lay_out(mine)
    message = toy.kendama(*command, "--home", str(mine), expect=2).stderr
    assert message.startswith(f"kendama: {mine} holds files and is no home of kendama (")
    assert message.endswith("name an empty or a new folder with --home\n")
    assert message.count("\n") == 1
    assert files(mine) == before


def test_in_a_home_that_shares_a_persons_folder_only_names_of_ours_are_deleted(tmp_path: Path) -> None:
    store = a_result(tmp_path)
    before = lay_out(tmp_path)
    left = store.checkpoint_folder("roll", "0" * 40)  # of work that is done
    left.mkdir(parents=True)
    (left / "00000001.ckpt").write_bytes(b"x")
    assert left in collect_garbage(store).deleted
    done = collect_garbage(store, keep_runs=0)
    kept = files(tmp_path)
    assert {name: kept.get(name) for name in PROJECT} == {name: before[name] for name in PROJECT}
    assert store.result_path("roll", "0" * 40) in done.deleted
    assert tmp_path / "objects/ab" / ("ab" * 32) in done.left, "its name could be ours, and it holds something else"


def test_nothing_is_deleted_through_a_link(tmp_path: Path) -> None:
    home, outside = tmp_path / "home", tmp_path / "outside"
    store = a_result(home)
    for name in ("results", "objects", "runs", "scratch"):
        (home / name).mkdir(exist_ok=True)
        shutil.move(home / name, outside / name)
        (home / name).symlink_to(outside / name)
    unnamed = shutil.copytree(next((outside / "objects").glob("??/*")), outside / "objects/ff" / ("f" * 64))
    (outside / "scratch" / ("a" * 32)).mkdir()
    (outside / "runs/00001-abcdef.json").write_text("damaged")
    (home / "checkpoints").mkdir()
    (home / "checkpoints/roll").symlink_to(outside)
    (outside / ("9" * 40)).mkdir()
    (home / "runs/00002-abcdef").symlink_to(tmp_path)
    before = sorted(outside.rglob("*"))
    done = collect_garbage(store, keep_runs=0)
    assert sorted(outside.rglob("*")) == before
    assert home / "objects/ff" / unnamed.name in done.left
    assert done.deleted == []


def test_a_home_that_is_itself_a_link_is_collected_as_any_other(tmp_path: Path) -> None:
    a_result(tmp_path / "disk")
    (tmp_path / "home").symlink_to(tmp_path / "disk")
    assert collect_garbage(Store(tmp_path / "home"), keep_runs=0).deleted != []
    assert not list((tmp_path / "disk/results").rglob("*.json"))


def test_a_dry_run_names_what_the_next_one_deletes(tmp_path: Path) -> None:
    store = a_result(tmp_path)
    before = files(tmp_path)
    told = collect_garbage(store, keep_runs=0, dry_run=True)
    assert files(tmp_path).keys() - before.keys() == {"locks/home.lock"}
    assert told == collect_garbage(store, keep_runs=0)
    assert len(told.deleted) == 2


@pytest.mark.parametrize("kept", ["results", "runs", "index"])
def test_a_home_without_a_mark_is_known_by_its_records_and_gets_one(toy: ToyProject, kept: str) -> None:
    toy.run_json()
    for path in toy.home.iterdir():
        if path.name != kept:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    toy.kendama("cache", "gc")
    assert durable.read_sealed(toy.home / MARK) == {"home": "kendama", "names": SINCE}
    toy.run_json()


def test_records_that_are_not_sealed_are_no_proof(tmp_path: Path) -> None:
    a_result(tmp_path)
    (tmp_path / MARK).unlink()
    (record,) = tmp_path.glob("results/roll/*.json")
    record.write_bytes(record.read_bytes()[:-2] + b"\n")
    with pytest.raises(UsageError, match="is no home of kendama"):
        claim(tmp_path)


def test_a_damaged_mark_is_found_and_written_anew(tmp_path: Path) -> None:
    a_result(tmp_path)
    (tmp_path / MARK).write_bytes(b"damaged")
    assert [one.path for one in verify(Store(tmp_path))] == [tmp_path / MARK]
    claim(tmp_path)
    assert verify(Store(tmp_path)) == []


def test_what_a_killed_beginning_left_is_no_file_of_a_person(tmp_path: Path) -> None:
    for name in ("lost+found", "locks"):
        (tmp_path / name).mkdir()
    (tmp_path / "locks/home.lock").touch()
    (tmp_path / f".scratch-{os.urandom(16).hex()}").write_bytes(b"half a mark")
    claim(tmp_path)
    assert (tmp_path / MARK).exists()
