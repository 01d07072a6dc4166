"""DART without the system's display libraries: stand-ins of our own, made by a script, are loaded in their place."""

from __future__ import annotations

import ctypes
import os
import platform
import subprocess
import sys
from importlib.metadata import files
from pathlib import Path

import pytest

from data.display_stubs import imported_functions, read_symbols, shared_objects, stub
from kendama_cli.robot_model.display import MACHINES, SONAMES, load_display_libraries, stub_path

ROOT = Path(__file__).resolve().parents[3]
BARE_MACHINE = Path(__file__).with_name("bare_machine.py")
WAIT = "{name: wait, duration_s: 0.2, position_m: [-0.12, 0, 1.06], rotation_rad: [0, 0, 0], force_n: [0, 0, 0]}"
linux = pytest.mark.skipif(sys.platform != "linux", reason="macOS and Windows wheels of DART need no stand-in")


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("soname", SONAMES)
def test_the_shipped_objects_are_what_the_script_writes(soname: str, machine: str) -> None:
    assert stub_path(soname, machine).read_bytes() == stub(soname, read_symbols()[soname], machine)


@linux
def test_every_function_that_the_installed_dart_imports_is_stood_in_for() -> None:
    listed = files("dartpy")
    assert listed is not None
    folder = Path(str(next(item.locate() for item in listed if item.name.startswith("dartpy")))).parent
    needed = imported_functions(shared_objects(folder))
    symbols = read_symbols()
    for soname in SONAMES:
        assert needed[soname], f"nothing found that {soname} should have: the reading of ELF files is wrong"
        assert needed[soname] <= set(symbols[soname])


@linux
@pytest.mark.skipif(platform.machine() not in MACHINES, reason="DART has no Linux wheel for this machine")
@pytest.mark.parametrize("soname", SONAMES)
def test_every_function_of_a_stand_in_returns_0_and_there_are_no_others(soname: str) -> None:
    library = ctypes.CDLL(str(stub_path(soname, platform.machine())))
    assert {getattr(library, name)() for name in read_symbols()[soname]} == {0}
    with pytest.raises(AttributeError):
        _ = library.glWhatNobodyImports


def test_on_a_machine_without_stand_ins_nothing_is_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: pytest.fail("loaded something"))
    monkeypatch.setattr(sys, "platform", "darwin")
    assert load_display_libraries() == ()
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(platform, "machine", lambda: "riscv64")
    assert load_display_libraries() == ()


def on_a_bare_machine(work: Path, *command: str) -> subprocess.CompletedProcess[str]:
    """``command`` where no display library is found; skips the test where no namespace can be made."""
    namespace = ["unshare", "--mount"] if os.geteuid() == 0 else ["unshare", "--map-root-user", "--mount"]
    try:
        possible = subprocess.run([*namespace, "true"], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        pytest.skip("no unshare here")
    if possible.returncode != 0:
        pytest.skip(f"no mount namespace can be made here: {possible.stderr.strip()}")
    folders, here = work / "folders", work / "here"
    for made in (folders, here):
        made.mkdir(exist_ok=True)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [*namespace, sys.executable, str(BARE_MACHINE), str(folders), *command],
        cwd=here,
        env=environment,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )


@linux
def test_where_the_system_has_no_display_library_dart_alone_fails_and_the_stages_run(tmp_path: Path) -> None:
    (tmp_path / "plain").mkdir()
    plain = on_a_bare_machine(tmp_path / "plain", sys.executable, "-c", "import dartpy")
    assert "libGL.so.1: cannot open shared object file" in plain.stderr, "the libraries were not hidden"
    (tmp_path / "ours").mkdir()
    kendama = [sys.executable, "-m", "kendama_cli.cli.main"]
    done = on_a_bare_machine(tmp_path / "ours", *kendama, "run", "-p", "press", "--json", f"interact.script=[{WAIT}]")
    assert done.returncode == 0, done.stderr
    assert "interact: done" in done.stderr


@linux
def test_doctor_says_whose_display_libraries_are_used(tmp_path: Path) -> None:
    """The doctor is narrowed to the parts that this test reads: it would import every other one too."""
    code = (
        "from kendama_cli.plugins.help import doctor; doctor._declared = list; doctor.EXTRAS = {};"
        "doctor.REQUIRED = {'dartpy': doctor.REQUIRED['dartpy']};"
        "print(*(f'{part.name} {part.state} {part.detail}' for part in doctor.examine()), sep='\\n')"
    )
    done = on_a_bare_machine(tmp_path, sys.executable, "-c", code)
    rows = {line.split()[0]: line for line in done.stdout.splitlines()}
    for soname in SONAMES:
        assert "not on this system; an object of ours stands in" in rows[soname]
    assert rows["dartpy"].split()[1] == "ok"
