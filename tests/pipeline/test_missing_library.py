"""A block whose library is not installed: told before a run begins, with the command that installs it."""

import importlib.util
from pathlib import Path

import pytest

from kendama_cli.errors import brings
from tests.cli.typed import kendama, refused


@pytest.mark.parametrize(
    ("module", "extra"),
    [("gymnasium", "gym"), ("uvicorn", "play"), ("pyarrow", "parquet"), ("distributed", "dask"), ("segno", "phone")],
)
def test_a_module_is_brought_by_the_smallest_extra_that_asks_for_it(module: str, extra: str) -> None:
    assert brings(module).startswith(f"pip install '.[{extra}]'")


def test_what_no_extra_brings_the_doctor_tells() -> None:
    assert "kendama doctor" in brings("nowhere")
    assert "kendama doctor" in brings("numpy")


@pytest.mark.skipif(importlib.util.find_spec("pylibfranka") is not None, reason="pylibfranka is installed")
def test_a_run_that_lacks_a_library_for_its_last_stage_does_not_begin(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    line = "'franka' needs pylibfranka; pip install '.[franka]'"
    assert line in refused(capsys, "run", "hardware=franka", "--arm")
    assert not list(tmp_path.rglob("runs/*.json"))
    code, out, _ = kendama(capsys, "plan", "hardware=franka")
    assert code == 0
    assert line in out.splitlines()[-1]
    assert kendama(capsys, "plan", "-p", "imitation", "hardware=franka")[0] == 0
