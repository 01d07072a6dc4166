"""Processes side by side: as many as asked for, ended with their parent, Ctrl-C left to it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from kendama_cli.system.processes import PROCESSES, cores_shared_by, process_pool, processes

PARENT = """
import os, sys, time
from kendama_cli.system.processes import process_pool
def nothing(): pass
if __name__ == "__main__":
    with process_pool(nothing) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        time.sleep(60)
"""


def nothing() -> None:
    """Begin without anything of one's own."""


def test_as_many_as_the_environment_says_or_every_core(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(PROCESSES, "3")
    assert processes() == 3
    for wrong in ("", "0", "many", "-2"):
        monkeypatch.setenv(PROCESSES, wrong)
        assert processes() == min(8, len(os.sched_getaffinity(0)))


def test_the_jobs_of_a_sweep_share_the_cores_unless_the_user_says_how_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(PROCESSES, raising=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: range(6))
    with cores_shared_by(2):
        assert processes() == 3
    with cores_shared_by(100):
        assert processes() == 1
    assert processes() == 6
    monkeypatch.setenv(PROCESSES, "5")
    with cores_shared_by(2):
        assert processes() == 5


def test_what_waits_at_the_end_is_not_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(PROCESSES, "1")
    with process_pool(nothing) as pool:
        first, *others = [pool.submit(time.sleep, 0.5) for _ in range(20)]
        first.result()
        began_s = time.monotonic()
    assert sum(other.cancelled() for other in others) >= 15
    assert time.monotonic() - began_s < 5.0, "not the ten seconds of all of them"


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_they_end_with_the_process_that_began_them(tmp_path: Path, number: signal.Signals) -> None:
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        os.kill(child, signal.SIGINT)  # as Ctrl-C, which reaches the whole group
        time.sleep(0.2)
        assert _lives(child)
        parent.send_signal(number)
        parent.wait()
    deadline = time.monotonic() + 10.0
    while _lives(child):
        assert time.monotonic() < deadline, "it outlives its parent"
        time.sleep(0.02)


def _lives(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False
