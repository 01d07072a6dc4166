"""Docstrings open as the field's do: a function's with a verb, the others with a noun; never with a clause."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "kendama_cli"
CLAUSES = {"What", "Whether", "How", "Where", "Which", "When", "Those", "Of", "As", "By", "From", "Its", "Who", "Why"}
ARTICLES = {"The", "A", "An", "Every", "Each", "All", "No", "One", "Both"}
STILL_OPEN = 0
"""Docstrings that open otherwise; the number only falls, and ends at zero."""


def opened_otherwise(file: Path) -> Iterator[str]:
    """Yield the places of docstrings that open with a clause, or a function's with an article."""
    for node in ast.walk(ast.parse(file.read_text())):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        first = (ast.get_docstring(node) or "").split()[:1]
        word = first[0].strip(",.;:'`\"") if first else ""
        names = [ast.unparse(decorator) for decorator in getattr(node, "decorator_list", [])]
        noun = isinstance(node, ast.Module | ast.ClassDef) or any("property" in name for name in names)
        if word in CLAUSES or (not noun and word in ARTICLES):
            yield f"{file.relative_to(PACKAGE)}:{getattr(node, 'lineno', 1)}"


def test_docstrings_open_with_a_verb_or_a_noun() -> None:
    found = [place for file in sorted(PACKAGE.rglob("*.py")) for place in opened_otherwise(file)]
    assert len(found) <= STILL_OPEN, "\n".join(found)


def test_the_rule_can_fail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{__name__}.PACKAGE", tmp_path)
    file = tmp_path / "one.py"
    file.write_text('"""Where it is."""\ndef f():\n    """The sum."""\ndef g():\n    """Return the sum."""\n')
    assert list(opened_otherwise(file)) == ["one.py:1", "one.py:2"]
