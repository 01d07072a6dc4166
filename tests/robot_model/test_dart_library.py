from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PROBE = "import kendama_cli.robot_model.dart_library"


@pytest.mark.parametrize(
    ("complaint", "advice"),
    [
        ("libGL.so.1: cannot open shared object file: No such file or directory", "apt-get install libgl1"),
        ("libX11.so.6: cannot open shared object file: No such file or directory", "apt-get install libgl1"),
        ("No module named 'dartpy'", "pip install dartpy"),
    ],
)
def test_where_dart_cannot_be_loaded_one_line_says_what_is_missing(tmp_path: Path, complaint: str, advice: str) -> None:
    (tmp_path / "dartpy.py").write_text(f"raise ImportError({complaint!r})\n")
    run = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {PROBE}"],
        capture_output=True,
        text=True,
        check=False,
    )
    last = run.stderr.strip().splitlines()[-1]
    assert "MissingPartError" in last
    assert advice in last
