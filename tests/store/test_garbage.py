"""Garbage collection keeps what cannot be read now; it deletes damage, and whatever a killed collection left."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from kendama_cli.errors import StoreError
from kendama_cli.store import durable
from kendama_cli.store.garbage import collect_garbage, verify
from kendama_cli.store.home import record_path, run_names
from kendama_cli.store.store import Store

UNNAMED = "f" * 64
"""The digest of an artifact that no result names."""


@pytest.fixture
def store(tmp_path: Path) -> Store:
    """A home with three artifacts, their results, and the record of a run that used them."""
    store = Store(tmp_path / "home")
    for number in range(3):
        with store.scratch_folder() as folder:
            (folder / "artifact.json").write_text(f'{{"number": {number}}}')
            (folder / "arrays.npz").write_bytes(bytes([number]) * 1000)
            store.put(folder, "roll", str(number) * 40, {"n": number}, {})
    stages = [{"name": "roll", "key": str(number) * 40} for number in range(3)]
    durable.write_sealed(record_path(store.home, "20260101-000000-aaaaaa"), {"stages": stages})
    return store


def files(store: Store) -> dict[str, bytes]:
    return {
        str(path.relative_to(store.home)): path.read_bytes()
        for path in sorted(store.home.rglob("*"))
        if path.is_file() and path.parent.name != "locks"
    }


@pytest.mark.parametrize("number", [errno.EIO, errno.EACCES, errno.ENOSPC, errno.EMFILE])
def test_a_collection_stops_at_a_file_that_cannot_be_read_and_has_deleted_nothing(
    store: Store, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(store.object_folder(collected(store)[0]), store.objects / "ff" / UNNAMED)
    before = files(store)
    for name in before:
        if UNNAMED in name or name == ".gitignore":  # Git reads it, not a collection
            continue
        with monkeypatch.context() as patch:
            break_reading(patch, store.home / name, number)
            with pytest.raises(StoreError, match=f"cannot read .*{os.strerror(number)}"):
                collect_garbage(Store(store.home))
        assert files(store) == before, name
    assert collect_garbage(store).deleted == [store.objects / "ff" / UNNAMED]


def test_a_folder_that_cannot_be_listed_is_not_an_empty_one(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    before = files(store)
    for folder in (store.results, store.results / "roll", store.objects, store.home / "runs"):
        with monkeypatch.context() as patch:
            break_reading(patch, folder, errno.EIO)
            with pytest.raises(StoreError, match="cannot read"):
                collect_garbage(store)
        assert files(store) == before


def test_what_one_reading_finds_damaged_and_a_later_one_whole_stays(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = files(store)
    whole, misread = Path.read_bytes, set[Path]()

    def first_reading_differs(path: Path) -> bytes:
        data = whole(path)
        if path in misread or path.suffix != ".json":
            return data
        misread.add(path)
        return bytes([data[0] ^ 1]) + data[1:]

    monkeypatch.setattr(Path, "read_bytes", first_reading_differs)
    collect_garbage(store)
    monkeypatch.undo()
    assert misread
    assert files(store) == before


def test_what_is_damaged_goes_with_what_only_it_named(store: Store) -> None:
    digest = collected(store)[1]
    (store.object_folder(digest) / "arrays.npz").write_bytes(b"flipped")
    (store.home / "runs" / "20260102-000000-bbbbbb").mkdir()
    (store.home / "runs" / "20260102-000000-bbbbbb" / "roll.txt").write_text("of a run whose record is gone")
    gone = collect_garbage(store).deleted
    assert store.object_folder(digest) in gone
    assert len(list(store.results.glob("*/*.json"))) == 2
    assert run_names(store.home) == ["20260101-000000-aaaaaa"]
    assert [path.name for path in (store.home / "runs").iterdir()] == ["20260101-000000-aaaaaa.json"]
    assert verify(store) == []


def test_a_checkpoint_whose_work_is_done_goes_and_an_unfinished_one_stays(store: Store) -> None:
    done, unfinished = store.checkpoint_folder("roll", "0" * 40), store.checkpoint_folder("roll", "9" * 40)
    for folder in (done, unfinished):
        folder.mkdir(parents=True)
        (folder / "00000001.ckpt").write_bytes(b"x")
    assert collect_garbage(store).deleted == [done]
    assert unfinished.is_dir()


def test_what_only_a_living_run_or_sweep_needs_is_collected_when_none_lives(store: Store) -> None:
    before = files(store)
    left = [store.home / "inputs" / ("0" * 32), store.home / "slurm" / ("1" * 16)]
    for folder in left:
        (folder / ("2" * 16)).mkdir(parents=True)
        (folder / ("2" * 16) / "file").write_text("x")
    with store.in_use(), pytest.raises(StoreError, match="a run is using"):
        collect_garbage(store)
    assert all((folder / ("2" * 16) / "file").exists() for folder in left)
    assert collect_garbage(store).deleted == left
    assert files(store) == before


def test_a_killed_collection_leaves_nothing_that_the_next_one_does_not_collect(store: Store) -> None:
    for number in range(20):
        shutil.copytree(store.object_folder(collected(store)[0]), store.objects / "ff" / f"{UNNAMED[:-2]}{number:02d}")
    kept = {name: data for name, data in files(store).items() if UNNAMED[:-2] not in name}
    code = (
        "import os, shutil, signal, sys; from pathlib import Path\n"
        "from kendama_cli.store.garbage import collect_garbage; from kendama_cli.store.store import Store\n"
        "left = int(sys.argv[2]); remove = os.unlink\n"
        "def unlink(*given, **named):\n"
        "    global left; left -= 1\n"
        "    if left < 0: os.kill(os.getpid(), signal.SIGKILL)\n"
        "    return remove(*given, **named)\n"
        "os.unlink = unlink\n"
        "collect_garbage(Store(Path(sys.argv[1])))\n"
    )
    for deletions in (0, 1, 2, 5):
        done = subprocess.run([sys.executable, "-c", code, str(store.home), str(deletions)], check=False)
        assert done.returncode == -signal.SIGKILL
        assert {name: data for name, data in files(store).items() if name in kept} == kept
    collect_garbage(store)
    assert files(store) == kept


def collected(store: Store) -> list[str]:
    """Digests of the artifacts that there are."""
    return [path.name for path in sorted(store.objects.glob("??/*"))]


def break_reading(patch: pytest.MonkeyPatch, broken: Path, number: int) -> None:
    """Let every way of opening ``broken`` fail as a failing disk would."""

    def fails(original: Any) -> Any:
        def opened(path: Any, *given: Any, **named: Any) -> Any:
            if Path(path) == broken:
                raise OSError(number, os.strerror(number), str(broken))
            return original(path, *given, **named)

        return opened

    for name in ("read_bytes", "open", "iterdir"):
        patch.setattr(Path, name, fails(getattr(Path, name)))
