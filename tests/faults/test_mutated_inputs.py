"""Whatever stands in a file or a text that kendama reads: it is used or refused in one line, soon, in little memory."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import random
import resource
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Iterable, Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from types import FrameType

import pytest

from kendama_cli.errors import KendamaError
from tests.faults.mutations import mutated
from tests.faults.readers import Kind, command, kinds

CORPUS = Path(__file__).with_name("corpus")
"""What once failed, a folder for each kind."""
QUICK, WHOLE = 5, 20_000
COMPOSE = {"override": 600, "first file": 400, "configuration": 600, "pipeline": 600}
"""Kinds of which each input takes a composition by Hydra, and so many of them are enough."""
MOST_S, MOST_BYTES = 10.0, 1 << 30
BATCH = 40

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="memory is limited by a means of Linux")


@pytest.fixture(scope="module")
def readers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Kind]]:
    folder = tmp_path_factory.mktemp("mutated")
    before = Path.cwd()
    os.chdir(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("KENDAMA_DEBUG", "1")
        patch.delenv("KENDAMA_HOME", raising=False)
        made = dict(kinds(folder))
        command("config")  # what a first command imports is no input's time: each batch is a fork of this process
        yield made
    os.chdir(before)


def problem(kind: Kind, path: Path) -> str | None:
    """What is wrong with how ``path`` was taken; None where it was read or refused in one line."""
    began_s = time.monotonic()
    try:
        kind.read(path)
    except KendamaError as error:
        lines = str(error).splitlines()
        if len(lines) != 1 or len(lines[0]) > 5000:
            return f"refused in {len(lines)} lines of {len(str(error))} signs: {str(error)[:300]}"
    except BaseException as error:
        return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}\n{traceback.format_exc()[-3000:]}"
    spent_s = time.monotonic() - began_s
    return f"took {spent_s:.1f} s" if spent_s > MOST_S else None


def _too_long(number: int, frame: FrameType | None) -> None:
    raise TimeoutError(f"more than {MOST_S} s")


def _work(kind: Kind, inputs: list[bytes], folder: Path, answers: Connection) -> None:
    """Take ``inputs`` one after the other in this process, and answer for each."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * os.sysconf("SC_PAGE_SIZE") + MOST_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    signal.signal(signal.SIGALRM, _too_long)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
        for data in inputs:
            folder.mkdir(parents=True, exist_ok=True)
            path = folder / kind.name
            path.write_bytes(data)
            signal.setitimer(signal.ITIMER_REAL, MOST_S)
            found = problem(kind, path)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            answers.send(found)
    os._exit(0)


def problems(kind: Kind, inputs: list[bytes]) -> Iterator[tuple[bytes, str]]:
    """Those of ``inputs`` that are not taken well; each batch is taken in a fork, so that none can end the test."""
    forking = multiprocessing.get_context("fork")
    waiting = list(inputs)
    while waiting:
        batch = waiting[:BATCH]
        here, there = forking.Pipe(duplex=False)
        process = forking.Process(target=_work, args=(kind, batch, Path.cwd() / "inputs", there))
        process.start()
        there.close()
        taken = 0
        with contextlib.suppress(EOFError):
            while taken < len(batch):
                if not here.poll(3 * MOST_S):
                    process.kill()
                found = here.recv()
                taken += 1
                if found is not None:
                    yield batch[taken - 1], found
        process.join()
        if taken < len(batch):  # it died of this one
            yield batch[taken], f"the process ended with {process.exitcode}"
            taken += 1
        waiting = waiting[taken:]


def told(found: Iterable[tuple[str, bytes, str]]) -> str:
    return "\n\n".join(f"{name}: {text}\ninput: {data[:400]!r}" for name, data, text in found)


def spoil(readers: dict[str, Kind], each: dict[str, int], seed: int) -> list[tuple[str, bytes, str]]:
    """Take so many spoiled inputs of each kind; those that were not taken well."""
    failed = []
    for name, count in each.items():
        kind = readers[name]
        rng = random.Random(f"{seed} {name}")
        inputs = [mutated(rng.choice(kind.examples), rng) for _ in range(count)]
        failed += [(name, data, found) for data, found in problems(kind, inputs)]
    return failed


def test_sound_inputs_are_taken(readers: dict[str, Kind]) -> None:
    """Mutants of inputs that are refused anyway would say nothing."""
    for name, kind in readers.items():
        if name in ("override", "pipeline"):
            continue
        for example in kind.examples:
            place = Path.cwd() / "inputs"
            place.mkdir(exist_ok=True)
            (place / kind.name).write_bytes(example)
            kind.read(place / kind.name)


def test_some_spoiled_inputs_are_taken_well(readers: dict[str, Kind]) -> None:
    failed = spoil(readers, {name: 1 if name in COMPOSE else QUICK for name in readers}, seed=0)
    assert not failed, told(failed)


def test_the_harness_sees_a_crash_a_hang_and_a_heap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(f"{__name__}.MOST_S", 0.3)

    def misbehave(path: Path) -> object:
        what = path.read_bytes()
        if what == b"crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        if what == b"hang":
            time.sleep(60)
        return bytes(2 * MOST_BYTES) if what == b"heap" else {}[what] if what == b"bug" else None

    inputs = [b"fine", b"crash", b"hang", b"heap", b"fine", b"bug"]
    found = dict(problems(Kind("x", (), misbehave), inputs))
    assert list(found) == [b"crash", b"hang", b"heap", b"bug"]
    assert "-11" in found[b"crash"]
    assert "TimeoutError" in found[b"hang"]
    assert "MemoryError" in found[b"heap"]
    assert "KeyError" in found[b"bug"]


def test_what_once_failed_is_taken_well(readers: dict[str, Kind]) -> None:
    files = sorted(path for path in CORPUS.rglob("*") if path.is_file())
    assert files
    failed = []
    for name, kind in readers.items():
        inputs = [path.read_bytes() for path in files if path.parent.name == name.replace(" ", "-").replace("'", "")]
        failed += [(name, data, found) for data, found in problems(kind, inputs)]
    assert not failed, told(failed)


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_spoiled_inputs_are_taken_well(readers: dict[str, Kind], tmp_path: Path) -> None:
    rest = (WHOLE - sum(COMPOSE.values())) // (len(readers) - len(COMPOSE)) + 1
    failed = spoil(readers, {name: COMPOSE.get(name, rest) for name in readers}, seed=int(os.environ.get("SEED", "1")))
    for number, (name, data, _) in enumerate(failed):
        place = tmp_path / "failed" / name.replace(" ", "-").replace("'", "")
        place.mkdir(parents=True, exist_ok=True)
        (place / f"{number:04d}").write_bytes(data)
    print(json.dumps(Counter(name for name, _, _ in failed)), tmp_path / "failed")
    assert not failed, told(failed)
