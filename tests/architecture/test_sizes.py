"""A file is one idea: its length, its classes' and its functions' have limits."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "kendama_cli"
FILE_LINES, CLASS_LINES, FUNCTION_LINES = 300, 150, 60


def above_the_limits(file: Path) -> Iterator[tuple[str, int]]:
    """What of ``file`` is too long, with its lines; kernels are compiled, and may be one long function."""
    name, text = file.relative_to(PACKAGE).as_posix(), file.read_text()
    if "kernel" in file.stem:
        return
    if text.count("\n") > FILE_LINES:
        yield name, text.count("\n")
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        lines = (node.end_lineno or 0) - node.lineno + 1
        if lines > (CLASS_LINES if isinstance(node, ast.ClassDef) else FUNCTION_LINES):
            yield f"{name}:{node.name}", lines


def test_files_classes_and_functions_are_short() -> None:
    found = {name: lines for file in sorted(PACKAGE.rglob("*.py")) for name, lines in above_the_limits(file)}
    assert found == {}


def test_the_limits_can_fail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{__name__}.PACKAGE", tmp_path)
    file = tmp_path / "long.py"
    file.write_text("class Long:\n    def long(self):\n" + "        pass\n" * 300)
    assert dict(above_the_limits(file)) == {"long.py": 302, "long.py:Long": 302, "long.py:long": 301}
