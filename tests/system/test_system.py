"""Linux's own means and the portable ones keep the same promises, but where docs/howto/platforms.md says otherwise."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from kendama_cli.system.interface import System, is_portable
from kendama_cli.system.linux import Linux
from kendama_cli.system.portable import Portable

HOLDER = """
import sys
from contextlib import ExitStack
from pathlib import Path
from kendama_cli.system.{module} import {name}
held = ExitStack()
got = {name}().{method}(Path(sys.argv[1]))
if hasattr(got, "__enter__"):
    held.enter_context(got)
print("holds" if got is not None else "refused", flush=True)
sys.stdin.read()
"""


@pytest.fixture(params=[Linux(), Portable()], ids=["linux", "portable"])
def system(request: pytest.FixtureRequest) -> System:
    return request.param  # type: ignore[no-any-return]


@contextmanager
def another_process(system: System, method: str, path: Path) -> Iterator[subprocess.Popen[str]]:
    """A process that holds ``path`` by ``method`` until it is killed."""
    name = type(system).__name__
    code = HOLDER.format(module=name.lower(), name=name, method=method)
    with subprocess.Popen(
        [sys.executable, "-c", code, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "holds\n"
            yield process
        finally:
            process.kill()


def within(seconds: float, condition: Callable[[], bool]) -> bool:
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


def test_a_lock_has_one_holder_and_is_free_when_that_was_killed(system: System, tmp_path: Path) -> None:
    path = tmp_path / "a.lock"
    with another_process(system, "try_lock", path) as holder:
        assert system.try_lock(path) is None
        holder.kill()
        holder.wait()
        lock = system.try_lock(path)
        assert lock is not None
        assert system.try_lock(path) is None, "not even this process has it twice"
        lock.release()
        again = system.try_lock(path)
        assert again is not None
        again.release()


def test_many_share_what_none_then_has_alone(system: System, tmp_path: Path) -> None:
    path = tmp_path / "home.lock"
    with another_process(system, "shared", path) as first, system.shared(path):
        with pytest.raises(BlockingIOError), system.alone(path):
            pass
        first.kill()
        first.wait()
        with pytest.raises(BlockingIOError), system.alone(path):
            pass
    with system.alone(path), pytest.raises(BlockingIOError), system.alone(path):
        pass


def test_one_that_shared_and_was_killed_is_in_nobodys_way(system: System, tmp_path: Path) -> None:
    path = tmp_path / "home.lock"
    with another_process(system, "shared", path) as first:
        first.kill()
        first.wait()
        with system.alone(path):
            pass


def test_sharing_waits_for_one_that_is_alone(system: System, tmp_path: Path) -> None:
    path = tmp_path / "home.lock"
    name = type(system).__name__
    code = HOLDER.format(module=name.lower(), name=name, method="shared")
    with ExitStack() as held:
        alone = held.enter_context(ExitStack())
        alone.enter_context(system.alone(path))
        command = [sys.executable, "-c", code, str(path)]
        process = held.enter_context(subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE))
        assert process.stdout is not None
        os.set_blocking(process.stdout.fileno(), False)
        time.sleep(1.0)
        assert process.stdout.read() is None
        alone.close()
        os.set_blocking(process.stdout.fileno(), True)
        assert process.stdout.readline() == b"holds\n"
        process.kill()


def test_a_marked_folder_is_in_use_until_its_marker_ends_or_is_killed(system: System, tmp_path: Path) -> None:
    assert not system.is_in_use(tmp_path)
    with system.mark_in_use(tmp_path):
        assert system.is_in_use(tmp_path)
    assert not system.is_in_use(tmp_path)
    assert list(tmp_path.iterdir()) == []
    with another_process(system, "mark_in_use", tmp_path) as marker:
        assert system.is_in_use(tmp_path)
        marker.kill()
        marker.wait()
        assert not system.is_in_use(tmp_path)


def test_files_and_folders_can_be_synced_and_what_is_missing_cannot(system: System, tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"x")
    system.sync(tmp_path / "file")
    system.sync(tmp_path)
    with pytest.raises(FileNotFoundError):
        system.sync(tmp_path / "missing")


@pytest.mark.parametrize("module", ["linux", "portable"])
def test_a_process_ends_with_its_parent(module: str, tmp_path: Path) -> None:
    child = (
        f"import signal, sys, time; from kendama_cli.system.{module} import {module.capitalize()};"
        "signal.signal(signal.SIGTERM, lambda *_: sys.exit(open(sys.argv[1], 'w').close()));"
        f"{module.capitalize()}().end_with_parent(); print('ready', flush=True); time.sleep(60)"
    )
    parent = (
        "import subprocess, sys, time;"
        "c = subprocess.Popen([sys.executable, '-c', sys.argv[1], sys.argv[2]], stdin=subprocess.PIPE);"
        "time.sleep(60)"
    )
    ended = tmp_path / "ended"
    with subprocess.Popen(
        [sys.executable, "-c", parent, child, str(ended)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"ready\n"
        assert not ended.exists()
        process.kill()
    assert within(20, ended.exists), "the child goes on"


def test_only_linux_passes_a_lock_on_to_children(tmp_path: Path) -> None:
    ours, portable = Linux().try_lock(tmp_path / "a"), Portable().try_lock(tmp_path / "b")
    assert ours is not None
    assert portable is not None
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE, pass_fds=ours.inherited) as child:
        ours.release()
        portable.release()
        assert Linux().try_lock(tmp_path / "a") is None
        child.kill()
    assert portable.inherited == ()


@pytest.mark.parametrize(("value", "portable"), [("1", True), ("0", False), ("", False), (None, False)])
def test_the_environment_chooses_the_portable_way(
    monkeypatch: pytest.MonkeyPatch, value: str | None, portable: bool
) -> None:
    monkeypatch.delenv("KENDAMA_PORTABLE", raising=False)
    if value is not None:
        monkeypatch.setenv("KENDAMA_PORTABLE", value)
    assert is_portable() is portable


def test_a_system_other_than_linux_takes_the_portable_way(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("KENDAMA_PORTABLE", raising=False)
    monkeypatch.setattr(sys, "platform", "win32")
    assert is_portable()


def test_everything_can_be_imported_where_there_is_no_fcntl() -> None:
    code = (
        "import sys; sys.modules.update(dict.fromkeys(['fcntl', 'termios', 'pty', 'resource', 'grp', 'pwd']));"
        "import kendama_cli.cli.app, kendama_cli.cli.run_work, kendama_cli.cli.sweep_work, kendama_cli.store.garbage;"
        "import kendama_cli.pipeline.worker;"
        "from kendama_cli.system.interface import system; print(type(system()).__name__)"
    )
    environment = {**os.environ, "KENDAMA_PORTABLE": "1"}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "Portable\n"
