"""Law in words, and what holds it."""

from __future__ import annotations


def must(holds: bool, words: str) -> None:
    """Raise AssertionError, with the law in ``words``, where it does not hold."""
    if not holds:
        raise AssertionError(f"broken law: {words}")
