"""Any call by which a home is changed fails or is the last one: nothing that was told is lost, nothing is torn."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.faults.power_loss import losses, read_journal
from tests.faults.store_work import SCENES, check, files, work

SHIM = Path(__file__).with_name("disk_shim.c")
REPOSITORY = Path(__file__).resolve().parents[2]
KINDS = {"SIGKILL": 1, "ENOSPC": 2, "EIO": 3, "EINTR": 4, "short write": 5}
ONCE, FROM_THEN_ON = 0, 1
CASES = [*((kind, ONCE) for kind in KINDS), ("ENOSPC", FROM_THEN_ON), ("EIO", FROM_THEN_ON)]


@dataclass(frozen=True)
class Ending:
    """End of a child: killed, done, refused (in one line), or with a traceback; its output; calls that it made."""

    ending: str
    told: list[str]
    calls: int


class Disk:
    """Children whose disk fails on request, each in a home of its own."""

    def __init__(self, folder: Path, shim: Path) -> None:
        self.folder = folder
        environment = {**os.environ, "LD_PRELOAD": str(shim), "OPENBLAS_NUM_THREADS": "1"}
        self._driver = subprocess.Popen(
            [sys.executable, "-m", "tests.faults.disk_driver"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=REPOSITORY,
            env=environment,
        )

    def work(self, home: Path, kind: str = "", at: int = 0, *, repeating: int = ONCE, journal: str = "") -> Ending:
        told = self.folder / "told"
        told.unlink(missing_ok=True)
        asked = {"home": str(home), "at": at, "kind": KINDS.get(kind, 0), "repeating": repeating}
        assert self._driver.stdin is not None
        assert self._driver.stdout is not None
        self._driver.stdin.write(json.dumps({**asked, "told": str(told), "journal": journal}) + "\n")
        self._driver.stdin.flush()
        code = int(self._driver.stdout.readline())
        lines = told.read_text().splitlines() if told.exists() else []
        if code != 0:
            return Ending(f"killed by {-code}", lines, 0)
        ended = json.loads(lines.pop())
        return Ending(ended["ending"], lines, ended["calls"])

    def close(self) -> None:
        assert self._driver.stdin is not None
        self._driver.stdin.close()
        self._driver.wait()


@pytest.fixture(scope="module")
def disk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Disk]:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if sys.platform != "linux" or compiler is None:
        pytest.skip("needs Linux and a C compiler")
    shim = tmp_path_factory.mktemp("shim") / "shim.so"
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", str(SHIM), "-o", str(shim), "-ldl"], check=True)
    # thousands of homes: in memory, where fsync costs nothing; what is durable is the shim's to say
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(dir=memory) as folder:
        made = Disk(Path(folder), shim)
        yield made
        made.close()


def meet_each(disk: Disk, scene: str, every: int) -> dict[str, int]:
    """Have each ``every``-th call of the work in ``scene`` meet each kind of fault; how often the work ended how."""
    model, home = disk.folder / f"model-{scene}", disk.folder / "home"
    damaged = SCENES[scene](model)
    shutil.copytree(model, home)
    whole = disk.work(home)
    assert whole.ending == "done"
    reference = files(home)
    assert whole.calls > 100
    ends: dict[str, int] = {}
    for case, (kind, repeating) in enumerate(CASES):
        for at in range(1 + case % every, whole.calls + 1, every):
            shutil.rmtree(home)
            shutil.copytree(model, home)
            ended = disk.work(home, kind, at, repeating=repeating)
            what = f"{kind} at call {at} of {scene}{' and from then on' * repeating}: {ended.ending}"
            assert not ended.ending.startswith("traceback"), what
            assert (ended.ending == "killed by 9") == (kind == "SIGKILL"), what
            try:
                check(home, ended.told, damaged)
                work(home, lambda line: None)
                again = files(home)
            except BaseException as error:
                raise AssertionError(what) from error
            assert again == reference, f"{what}: {sorted(set(again) ^ set(reference))}"
            ends[ended.ending] = ends.get(ended.ending, 0) + 1
    shutil.rmtree(home)
    return ends


def test_some_calls_that_fail_lose_nothing(disk: Disk) -> None:
    ends = [meet_each(disk, scene, every=23) for scene in SCENES]
    assert sum(sum(each.values()) for each in ends) >= 80
    # a harness whose faults do not reach the store would pass too
    assert all(each["refused"] > 5 and each["killed by 9"] > 5 for each in ends)


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_every_call_that_fails_loses_nothing(disk: Disk) -> None:
    ends = {scene: meet_each(disk, scene, every=1) for scene in SCENES}
    print(ends)
    assert sum(sum(each.values()) for each in ends.values()) >= 2000


def lose_power(disk: Disk, every: int) -> int:
    """Cut the power after each ``every``-th thing that the work did; how often."""
    home, journal = disk.folder / "home", disk.folder / "journal"
    cuts = 0
    for scene, build in SCENES.items():
        damaged = build(home)
        model = disk.folder / "before"
        shutil.copytree(home, model)
        assert disk.work(home, journal=str(journal)).ending == "done"
        reference = files(home)
        records = read_journal(journal.read_bytes())
        assert len(records) > 100
        for number in range(0, len(records) + 1, every):
            for variant, (left, told) in losses(model, home, records[:number], seed=number):
                shutil.rmtree(home)
                left.write(home)
                try:
                    check(home, told, damaged)
                    work(home, lambda line: None)
                except BaseException as error:
                    raise AssertionError(f"power lost after {number} in {scene}, {variant}") from error
                assert files(home) == reference, f"power lost after {number} in {scene}, {variant}"
                cuts += 1
        for folder in (home, model):
            shutil.rmtree(folder)
        journal.unlink()
    return cuts


def test_a_power_cut_loses_nothing_that_was_told(disk: Disk) -> None:
    assert lose_power(disk, every=29) >= 50


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_a_power_cut_at_any_moment_loses_nothing_that_was_told(disk: Disk) -> None:
    cuts = lose_power(disk, every=1)
    print(f"{cuts} power cuts")
    assert cuts >= 200
