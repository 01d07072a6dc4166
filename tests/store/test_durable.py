"""A write is whole or absent, wherever it is cut off."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from kendama_cli.errors import StoreError
from kendama_cli.store import durable

CRASH = """
import os, sys
from pathlib import Path
from kendama_cli.store import durable

count = int(sys.argv[2])
def countdown(function):
    def wrapped(*arguments, **options):
        global count
        if count == 0:
            os._exit(9)
        count -= 1
        return function(*arguments, **options)
    return wrapped
for name in ("fsync", "replace", "open", "close"):
    setattr(os, name, countdown(getattr(os, name)))
real_open = Path.open
def torn_open(self, mode="r", *rest, **options):
    stream = real_open(self, mode, *rest, **options)
    if "w" in mode:
        write = stream.write
        def half(data):
            global count
            if count == 0:
                write(data[: len(data) // 2]); stream.flush(); os._exit(9)
            count -= 1
            return write(data)
        class Torn:
            def __enter__(self): return self
            def __exit__(self, *error): stream.close()
            def __getattr__(self, name): return getattr(stream, name)
        torn = Torn()
        torn.write = half
        return torn
    return stream
Path.open = torn_open
durable.write_file(Path(sys.argv[1]), b"new" * 1000)
os._exit(0)
"""


def test_a_write_cut_off_at_any_step_leaves_the_old_or_the_new_content(tmp_path: Path) -> None:
    target = tmp_path / "file"
    ends = []
    for step in range(20):
        durable.write_file(target, b"old" * 1000)
        done = subprocess.run([sys.executable, "-c", CRASH, str(target), str(step)], check=False)
        ends.append(done.returncode)
        assert target.read_bytes() in (b"old" * 1000, b"new" * 1000), f"torn at step {step}"
        if done.returncode == 0:
            assert target.read_bytes() == b"new" * 1000
            break
    assert ends[-1] == 0
    assert ends.count(9) >= 5, "the write was cut at several steps"


def test_the_file_is_synced_before_it_gets_its_name_and_the_folder_after(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[str] = []
    sync, replace = os.fsync, os.replace

    def told_sync(handle: int) -> None:
        calls.append("folder" if os.path.isdir(f"/proc/self/fd/{handle}") else "file")
        sync(handle)

    monkeypatch.setattr(os, "fsync", told_sync)
    monkeypatch.setattr(os, "replace", lambda old, new: (calls.append("rename"), replace(old, new))[1])
    durable.write_file(tmp_path / "file", b"content")
    assert calls == ["file", "rename", "folder"]


def test_a_sealed_record_with_any_byte_changed_reads_as_none(tmp_path: Path) -> None:
    path = tmp_path / "record.json"
    durable.write_sealed(path, {"key": "abc", "metrics": {"n": 3, "x": 0.5}})
    assert durable.read_sealed(path) == {"key": "abc", "metrics": {"n": 3, "x": 0.5}}
    data = path.read_bytes()
    for place in range(len(data)):
        damaged = bytearray(data)
        damaged[place] ^= 1
        path.write_bytes(damaged)
        assert durable.read_sealed(path) is None, f"byte {place}"
        path.write_bytes(data[:place])
        assert durable.read_sealed(path) is None, f"cut at {place}"


def test_a_refused_write_is_one_line_with_a_next_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(StoreError, match=r"the disk is full; free some space or choose another folder with --home"):
        durable.write_file(tmp_path / "file", b"content")
    assert list(tmp_path.iterdir()) == []


def test_nothing_else_renames() -> None:
    package = Path(durable.__file__).parents[1]
    renaming = [
        str(file.relative_to(package))
        for file in package.rglob("*.py")
        if any(word in file.read_text() for word in ("os.replace(", "os.rename(", "shutil.move("))
    ]
    assert renaming == ["store/durable.py"]
