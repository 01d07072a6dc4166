"""A flipped bit or a missing end in any kind of file of a home is found by ``cache verify``, and never served."""

from __future__ import annotations

import json
import random
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from kendama_cli.errors import KendamaError
from kendama_cli.log.container_writer import CHUNK_BYTES, ContainerWriter
from kendama_cli.log.reader import LogFile
from kendama_cli.pipeline.record import past_runs
from kendama_cli.store import durable
from kendama_cli.store.checkpoint import CheckpointFolder, DurableAppendFile
from kendama_cli.store.garbage import verify
from kendama_cli.store.store import Store
from tests.toy_project import ToyProject

QUICK, WHOLE = 150, 1000


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A home with every kind of file: finished and failed runs, a checkpoint with a log, indexes."""
    toy = ToyProject(tmp_path_factory.mktemp("toy"))
    toy.run_json()
    toy.run_json(f"toy.kill_file={toy.folder}/killed", expect=1)
    folder = CheckpointFolder(toy.home / "checkpoints/roll" / ("a" * 40))
    log = ContainerWriter(DurableAppendFile(folder.log_path))
    channel = log.add_channel("/a", "b", b"")
    log.add(channel, 0, random.Random(0).randbytes(CHUNK_BYTES))
    folder.save({"values": [1.0]}, {}, log.position())
    return toy.home


def kinds(home: Path) -> dict[str, list[Path]]:
    """Files by kind: the folder at the top, and the name or its ending."""
    found: dict[str, list[Path]] = {}
    for path in sorted(home.rglob("*")):
        top = path.relative_to(home).parts[0]
        if path.is_file() and top != "locks" and path.stat().st_size:
            name = path.name if top == "objects" else path.suffix
            found.setdefault(f"{top} {name}", []).append(path)
    return found


def damaged(path: Path, rng: random.Random) -> Iterator[str]:
    """Damage ``path`` in one way, say how, and put it back."""
    whole = path.read_bytes()
    if rng.random() < 0.2:
        size = rng.randrange(len(whole))
        path.write_bytes(whole[:size])
        yield f"{path} cut to {size} of {len(whole)} bytes"
    else:
        place, bit = rng.randrange(len(whole)), rng.randrange(8)
        path.write_bytes(whole[:place] + bytes([whole[place] ^ (1 << bit)]) + whole[place + 1 :])
        yield f"bit {bit} of byte {place} of {path}"
    path.write_bytes(whole)


def served(home: Path) -> dict[str, object]:
    """All that is given to anybody who asks, by what it is."""
    store = Store(home)
    given: dict[str, object] = {}
    for path in sorted((home / "results").glob("*/*.json")):
        result = store.find(path.parent.name, path.stem)
        if result is not None:
            files = {file.name: file.read_bytes() for file in sorted(result.artifact.iterdir())}
            given[f"result {path.stem}"] = (result.metrics, result.parts, files)
    for record in past_runs(home):
        given[f"run {record['run']}"] = record
    for folder in sorted((home / "checkpoints").glob("*/*")):
        for found in CheckpointFolder(folder).intact():
            given[f"checkpoint {folder.name} {len(found.state['values'])}"] = (found.log, repr(found.state))
    for path in sorted((home / "index").rglob("*.json")):
        if (value := durable.read_index(path)) is not None:
            given[f"index {path}"] = json.dumps(value)
    for path in sorted((home / "objects").glob("*/*/log.mcap")):
        try:
            given[f"log {path}"] = LogFile(path).describe()
        except KendamaError:
            continue
    return given


def flip(home: Path, times: int, seed: int) -> dict[str, int]:
    """Damage a file of each kind in turn; how often each kind."""
    assert verify(Store(home)) == []
    whole, rng = served(home), random.Random(seed)
    files, counted = kinds(home), {}
    for number in range(times):
        kind = sorted(files)[number % len(files)]
        path = rng.choice(files[kind])
        for what in damaged(path, rng):
            found = [str(one.path) for one in verify(Store(home))]
            assert found, f"{what}: verify found nothing"
            assert any(one.startswith(str(path.parent)) for one in found), f"{what}: verify found {found}"
            for name, value in served(home).items():
                assert whole.get(name) == value, f"{what}: {name} was served"
        counted[kind] = counted.get(kind, 0) + 1
    assert verify(Store(home)) == []
    return counted


@pytest.mark.slow
def test_some_damage_is_found_and_never_served(home: Path) -> None:
    counted = flip(home, QUICK, seed=1)
    assert {kind.split()[0] for kind in counted} == {"checkpoints", "index", "objects", "results", "runs"}
    assert len(counted) >= 10


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_damage_is_found_and_never_served(home: Path, tmp_path: Path) -> None:
    copy = tmp_path / "home"
    shutil.copytree(home, copy)
    counted = flip(copy, WHOLE, seed=2)
    print(counted)
    assert sum(counted.values()) == WHOLE
