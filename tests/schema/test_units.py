"""Counts in words."""

from __future__ import annotations

from kendama_cli.schema.units import count_of


def test_one_is_no_plural() -> None:
    assert [count_of(n, "file") for n in (0, 1, 2)] == ["0 files", "1 file", "2 files"]
