"""Kills, interruptions, full disks and rivals: nothing finished is lost, and the end is the same to the byte."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.portable import portable_is_slow
from tests.toy_project import ToyProject, artifact_bytes, statuses

SLOW = ("toy.steps=30", "toy.pause_s=0.05")


@pytest.fixture
def toy(tmp_path: Path) -> ToyProject:
    """Most of these tests run it several times, and processes are what they are about."""
    return ToyProject(tmp_path, alone=True, real_workers=True)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, bytes]]:
    """Every file that a run of ``SLOW`` which nothing disturbs ends in; both ways of starting workers give the same."""
    return artifact_bytes(ToyProject(tmp_path_factory.mktemp("uninterrupted"), alone=True).run_json(*SLOW))


def wait_for(condition: object, seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if callable(condition) and condition():
            return
        time.sleep(0.02)
    raise AssertionError(f"nothing happened within {seconds} s")


def checkpoints(toy: ToyProject) -> list[Path]:
    return sorted(toy.home.glob("checkpoints/roll/*/*.ckpt"))


def number(path: Path) -> int:
    return int(path.stem)


def worker_of(process: subprocess.Popen[str]) -> list[int]:
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    return [int(pid) for pid in children.read_text().split()] if children.exists() else []


@portable_is_slow
@pytest.mark.usefixtures("each_way")
def test_kill_9_of_the_worker_fails_the_run_and_the_next_goes_on_to_the_same_bytes(toy: ToyProject) -> None:
    count = toy.folder / "count"
    options = [f"toy.kill_file={toy.folder}/killed", f"toy.count_file={count}"]
    failed = toy.run_json(*options, expect=1)
    assert statuses(failed) == {"roll": "failed"}
    assert "SIGKILL" in failed["stages"][0]["error"]
    planned = toy.kendama("plan", "-p", "toy", *options).stdout.splitlines()[0]
    assert planned.split(None, 2) == ["roll", "run", "resumes from its last checkpoint"]
    resumed = toy.run_json(*options)
    assert statuses(resumed) == {"roll": "ran", "total": "ran"}
    assert count.read_text() == "x" * 20, "each number was drawn once: ten before the kill, ten after"
    whole = toy.run_json(*options, "--home", "other")
    assert artifact_bytes(resumed) == artifact_bytes(whole)


def test_what_a_moving_stage_logged_before_it_failed_stands_beside_the_run(toy: ToyProject) -> None:
    declaration = toy.folder / "lib" / "toy" / "roll" / "__init__.py"
    declaration.write_text(declaration.read_text().replace("topics=TOPICS", 'topics=TOPICS, kind="moves"'))
    failed = toy.run_json("toy.fail_at=5", expect=1)
    told = toy.kendama("log", "info", f"{failed['run']}/roll").stdout
    assert re.search(r"/roll/number.*\b5\n", told), told
    toy.kendama("report", failed["run"], "-o", "page.html")
    page = (toy.folder / "page.html").read_text()
    assert "5 numbers" in page
    assert "the stage broke off: told to fail at 5" in page
    assert statuses(toy.run_json("toy.fail_at=5", expect=1)) == {"roll": "failed"}, "it goes on from its checkpoint"


@pytest.mark.parametrize(
    "after", [pytest.param(1, marks=pytest.mark.slow), 7, pytest.param(20, marks=pytest.mark.slow)]
)
@pytest.mark.usefixtures("each_way")
def test_kill_9_of_the_run_at_any_moment_ends_in_the_same_bytes(
    toy: ToyProject, after: int, uninterrupted: dict[str, dict[str, bytes]]
) -> None:
    process = toy.start("run", "-p", "toy", *SLOW)
    wait_for(lambda: checkpoints(toy) and number(checkpoints(toy)[-1]) >= after)
    workers = worker_of(process)
    assert workers
    process.kill()
    process.wait()
    wait_for(lambda: not any(Path(f"/proc/{pid}/stat").exists() for pid in workers))
    reached = number(checkpoints(toy)[-1])
    assert after <= reached < 30
    resumed = toy.run_json(*SLOW)
    assert statuses(resumed) == {"roll": "ran", "total": "ran"}
    assert artifact_bytes(resumed) == uninterrupted
    toy.kendama("cache", "verify")


def test_a_damaged_newest_checkpoint_is_passed_over_for_the_one_before(toy: ToyProject) -> None:
    options = [f"toy.kill_file={toy.folder}/killed"]
    toy.run_json(*options, expect=1)
    newest = checkpoints(toy)[-1]
    data = bytearray(newest.read_bytes())
    data[len(data) // 2] ^= 1
    newest.write_bytes(data)
    resumed = toy.run_json(*options)
    assert artifact_bytes(resumed) == artifact_bytes(toy.run_json(*options, "--home", "other"))


@portable_is_slow
@pytest.mark.usefixtures("each_way")
def test_a_killed_run_is_listed_as_killed_and_one_that_goes_on_as_running(toy: ToyProject) -> None:
    process = toy.start("run", "-p", "toy", *SLOW)
    wait_for(lambda: checkpoints(toy))
    assert json.loads(toy.kendama("runs", "--json").stdout)[0]["outcome"] == "running"
    process.kill()
    process.wait()
    assert json.loads(toy.kendama("runs", "--json").stdout)[0]["outcome"] == "killed"


@portable_is_slow
@pytest.mark.usefixtures("each_way")
def test_ctrl_c_ends_with_130_and_one_line_and_keeps_what_was_done(toy: ToyProject) -> None:
    process = toy.start("run", "-p", "toy", *SLOW)
    wait_for(lambda: len(checkpoints(toy)) > 1)
    process.send_signal(signal.SIGINT)
    _, printed = process.communicate(timeout=60)
    assert process.returncode == 130
    assert printed.splitlines()[-1].startswith("kendama: interrupted")
    assert "Traceback" not in printed
    assert json.loads(toy.kendama("runs", "--json").stdout)[-1]["outcome"] == "interrupted"
    assert checkpoints(toy)
    assert statuses(toy.run_json(*SLOW)) == {"roll": "ran", "total": "ran"}


@pytest.mark.usefixtures("each_way")
def test_two_runs_at_once_compute_a_shared_stage_once(toy: ToyProject) -> None:
    count = toy.folder / "count"
    options = ("toy.steps=20", "toy.pause_s=0.05", f"toy.count_file={count}")
    rivals = [toy.start("run", "-p", "toy", "--json", *options) for _ in range(2)]
    documents = [json.loads(rival.communicate(timeout=180)[0]) for rival in rivals]
    assert count.read_text() == "x" * 20
    assert sorted(statuses(document)["roll"] for document in documents) == ["cached", "ran"]
    assert len({json.dumps(document["stages"][1]["metrics"]) for document in documents}) == 1


@portable_is_slow
@pytest.mark.usefixtures("each_way")
def test_a_rival_takes_over_when_the_first_run_is_killed(
    toy: ToyProject, uninterrupted: dict[str, dict[str, bytes]]
) -> None:
    first = toy.start("run", "-p", "toy", *SLOW)
    wait_for(lambda: len(checkpoints(toy)) > 1)
    second = toy.start("run", "-p", "toy", "--json", *SLOW)
    time.sleep(0.5)
    first.kill()
    document = json.loads(second.communicate(timeout=180)[0])
    assert statuses(document) == {"roll": "ran", "total": "ran"}
    assert artifact_bytes(document) == uninterrupted


@portable_is_slow
@pytest.mark.usefixtures("each_way")
def test_garbage_is_not_collected_under_a_run(toy: ToyProject) -> None:
    process = toy.start("run", "-p", "toy", *SLOW)
    wait_for(lambda: checkpoints(toy))
    assert "a run is using" in toy.kendama("cache", "gc", expect=1).stderr
    assert process.wait(timeout=90) == 0


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system with room for 600 kB."""
    place = tmp_path / "small"
    place.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=600k", "tmpfs", str(place)], capture_output=True, text=True, check=False
    )
    if mounted.returncode != 0:
        pytest.skip(f"cannot mount a small file system here: {mounted.stderr.strip()}")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def test_a_full_disk_is_one_line_and_loses_nothing_finished(toy: ToyProject, small_disk: Path) -> None:
    home = ("--home", str(small_disk / "home"))
    toy.run_json(*home, "--until", "roll")
    filler = small_disk / "filler"
    with filler.open("wb", buffering=0) as stream:
        try:
            while True:
                stream.write(b"0" * 1024)
        except OSError:
            pass
    done = toy.kendama("run", "-p", "toy", *home, expect=1)
    assert "the disk is full" in done.stderr
    assert len(done.stderr.strip().splitlines()[-1]) < 300
    filler.unlink()
    assert statuses(toy.run_json(*home)) == {"roll": "cached", "total": "ran"}
    toy.kendama("cache", "verify", *home)


@pytest.mark.parametrize(
    "free_kb", [pytest.param(16, marks=pytest.mark.slow), 24, pytest.param(32, marks=pytest.mark.slow)]
)
def test_a_disk_that_fills_at_any_write_of_a_stage_is_told_as_full(
    toy: ToyProject, small_disk: Path, free_kb: int
) -> None:
    home = ("--home", str(small_disk / "home"))
    toy.kendama("plan", "-p", "toy", *home)
    free = os.statvfs(small_disk)
    (small_disk / "filler").write_bytes(b"0" * (free.f_bavail * free.f_bsize - free_kb * 1024))
    done = toy.kendama("run", "-p", "toy", *home, expect=1)
    assert "the disk is full" in done.stderr
    assert "(unexpected; " not in done.stderr


def test_a_home_that_cannot_be_written_is_one_line(toy: ToyProject) -> None:
    (toy.folder / "file").write_text("")
    done = toy.kendama("run", "-p", "toy", "--home", "file/home", expect=1)
    assert len(done.stderr.strip().splitlines()) == 1
    assert "cannot write" in done.stderr


@portable_is_slow
@pytest.mark.usefixtures("each_way")
def test_no_lock_or_scratch_outlives_the_run_that_made_it(toy: ToyProject) -> None:
    toy.run_json()
    left = [path for path in toy.home.rglob("*") if path.name.startswith(".scratch") or path.parent.name == "scratch"]
    assert left == []
    assert os.listdir(toy.home / "checkpoints") in ([], ["roll"], ["total", "roll"], ["roll", "total"])
