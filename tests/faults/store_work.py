"""Work of a run on its home, in small: checkpoints with a log, results, the run's record, garbage collection.

``work`` is the same whenever it is done, so that whatever happened on the way must end in the same files.
"""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from kendama_cli.log import container_writer
from kendama_cli.log.container_writer import ContainerWriter
from kendama_cli.pipeline.record import RunRecord, StageOutcome
from kendama_cli.store import durable
from kendama_cli.store.checkpoint import CheckpointFolder, DurableAppendFile
from kendama_cli.store.garbage import collect_garbage, verify
from kendama_cli.store.store import Store

KEYS = ("1" * 40, "2" * 40)
STEPS = 3
UNFINISHED = "3" * 40
"""Its work stays a checkpoint."""
RUN = "00001-abcdef"

Tell = Callable[[str], None]


def content(key: str) -> dict[str, bytes]:
    """The files of the artifact of ``key``."""
    return {"artifact.json": f'{{"key": "{key}"}}'.encode(), "arrays.npz": key.encode() * 50, "log.mcap": b"log" * 70}


def work(home: Path, tell: Tell) -> None:
    """Do all of it; ``tell`` hears of each thing as soon as it counts as done."""
    usual = container_writer.CHUNK_BYTES
    container_writer.CHUNK_BYTES = 64  # so that the log grows with every checkpoint
    try:
        _work(home, tell)
    finally:
        container_writer.CHUNK_BYTES = usual


def _work(home: Path, tell: Tell) -> None:
    store = Store(home)
    with store.in_use(), contextlib.ExitStack() as held:
        record = RunRecord(home, RUN, "toy", [], "2026-01-01", versions={})
        record.begin(held)
        tell("record 0")
        for number, key in enumerate(KEYS, 1):
            _checkpoint(store, key, tell)
            with store.scratch_folder() as folder:
                for name, data in content(key).items():
                    with durable.plain_disk_errors(folder):
                        (folder / name).write_bytes(data)
                result = store.put(folder, "roll", key, {"n": number}, {"why": key})
            tell(f"put {key}")
            printed = record.folder / f"{number}.txt"
            with durable.plain_disk_errors(printed):
                printed.write_text(f"printed {number}\n")
            record.stages.append(StageOutcome(str(number), "roll", key, "ran", 1.0, str(result.artifact), {}))
            record.save()
            tell(f"record {number}")
        _checkpoint(store, UNFINISHED, tell)
        durable.write_index(home / "index" / "files.json", {"a": [1, 2]})
    collect_garbage(store)
    tell("gc")


def check(home: Path, told: list[str], damaged_before: frozenset[str] = frozenset()) -> None:
    """Assert that nothing that was told is lost, and that nothing is torn."""
    store = Store(home)
    damage = {str(one.path.relative_to(home)) for one in verify(store)} - damaged_before
    assert not {path for path in damage if not path.startswith("index/")}, damage
    for key in KEYS:
        found = store.find("roll", key)
        if found is not None:
            assert {name: (found.artifact / name).read_bytes() for name in content(key)} == content(key)
        assert found is not None or f"put {key}" not in told, "a result that was told is lost"
    record = durable.read_sealed(home / "runs" / f"{RUN}.json")
    saved = [int(line.split()[1]) for line in told if line.startswith("record")]
    assert not saved or (record is not None and len(record["stages"]) >= saved[-1]), "a record that was told is lost"
    for key in (*KEYS, UNFINISHED):
        steps = [int(line.split()[2]) for line in told if line.startswith(f"checkpoint {key}")]
        if steps and (key == UNFINISHED or store.find("roll", key) is None):
            newest = next(CheckpointFolder(store.checkpoint_folder("roll", key)).intact(), None)
            assert newest is not None, "a checkpoint that was told is lost"
            assert newest.state["n"] >= steps[-1], "a checkpoint that was told is lost"
            assert np.array_equal(newest.state["x"], np.arange(newest.state["n"]))


def files(home: Path) -> dict[str, bytes]:
    """All files of ``home`` by path, but locks, Git's, and checkpoints, whose numbers go on after a damaged one."""
    found = {str(path.relative_to(home)): path for path in sorted(home.rglob("*")) if path.is_file()}
    kept = CheckpointFolder(home / "checkpoints" / "roll" / UNFINISHED)
    assert len(kept.files()) <= 3, "checkpoints pile up"  # two, and one that a kill kept from being deleted
    newest = next(kept.intact())
    return {
        **{
            name: path.read_bytes()
            for name, path in found.items()
            if not name.startswith(("locks/", "checkpoints/", ".git"))
        },
        **{name: b"" for name in found if name.startswith("checkpoints/") and UNFINISHED not in name},
        "newest checkpoint": repr(newest.state["n"]).encode() + (home / kept.log_path).read_bytes(),
    }


def empty(home: Path) -> frozenset[str]:
    """A new home; nothing in it is damaged."""
    home.mkdir(parents=True)
    return frozenset()


def used(home: Path) -> frozenset[str]:
    """A home of finished work in which an artifact, a checkpoint and a record are damaged, beside what kills left."""
    home.mkdir(parents=True)
    work(home, lambda line: None)
    store = Store(home)
    found = store.find("roll", KEYS[0])
    assert found is not None
    newest = CheckpointFolder(store.checkpoint_folder("roll", UNFINISHED)).files()[-1]
    damaged = [found.artifact / "arrays.npz", newest, home / "runs/00002-bbbbbb.json"]
    for path in damaged:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"damaged")
    shutil.copytree(found.artifact, store.objects / "ff" / ("f" * 64))
    damaged.append(store.objects / "ff" / ("f" * 64) / "manifest.json")
    for place in ("results/roll", "objects/aa", "checkpoints/roll", "runs", "scratch"):
        left = home / place / f"{durable.SCRATCH}-{0:032x}"
        left.mkdir(parents=True)
        (left / "file").write_bytes(b"half")
    damaged.append(store.result_path("roll", KEYS[0]))  # while its artifact is being replaced it has none
    return frozenset(str(path.relative_to(home)) for path in damaged)


SCENES: Mapping[str, Callable[[Path], frozenset[str]]] = {"empty": empty, "used": used}


def _checkpoint(store: Store, key: str, tell: Tell) -> None:
    if store.find("roll", key) is not None:
        return
    folder = CheckpointFolder(store.checkpoint_folder("roll", key))
    file = DurableAppendFile(folder.log_path)
    log = ContainerWriter(file)
    try:
        first = 1
        for found in folder.intact():  # as a stage's context does
            with contextlib.suppress(ValueError):
                log.restore(found.log)
                first = found.state["n"] + 1
                break
        channel = log.channels.get("/a") or log.add_channel("/a", "b", b"")
        for step in range(first, STEPS + 1):
            log.add(channel, step, bytes([step]) * 100)
            file.sync()
            folder.save({"n": step, "x": np.arange(step)}, {}, log.position())
            tell(f"checkpoint {key} {step}")
    finally:
        file.close()
