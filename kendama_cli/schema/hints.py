"""Hints on a name that does not exist: its name of today, or the one that is spelled nearest.

Standard library only, and the table of names that changed is read in errors alone.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from kendama_cli.errors import ConfigError


def nearest(word: str, candidates: Iterable[str]) -> str:
    """Return ``, did you mean '...'?`` for the closest candidate, or an empty string."""
    close = difflib.get_close_matches(word, list(candidates), n=1, cutoff=0.6)
    return f", did you mean '{close[0]}'?" if close else ""


def unknown_key(key: str, siblings: Iterable[str], below: Iterable[str] = ()) -> ConfigError:
    """Return the error for a key that the schema does not have; ``below`` are dotted names beneath the siblings.

    The hint is the key's name of today where it had another, else the sibling that is spelled nearest, else what
    beneath one has the nearest last word.
    """
    from kendama_cli.schema.renames import new_key, now_called  # noqa: PLC0415 - a table that is read in errors alone

    if (new := new_key(key)) != key:
        return ConfigError(key, f"unknown key '{key}'{now_called(key, new)}")
    prefix, _, name = key.rpartition(".")
    place = f"{prefix}." if prefix else ""
    known = sorted(siblings)
    # the last word is what was mistyped: comparing whole paths would find every sibling alike
    close = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    if not close:
        by_word = {path.rpartition(".")[2]: path for path in sorted(below, reverse=True)}
        close = [by_word[word] for word in difflib.get_close_matches(name, by_word, n=1, cutoff=0.75)]
    hint = (
        f", did you mean '{place}{close[0]}'?"
        if close
        else "; allowed here: " + ", ".join(place + word for word in known)
    )
    return ConfigError(key, f"unknown key '{key}'{hint}")


def value_hint(key: str, value: object, allowed: Iterable[str]) -> str:
    """Return what a wrong value is called today, where it had another name, else the nearest that is allowed."""
    from kendama_cli.schema.renames import value_now_called  # noqa: PLC0415 - a table that is read in errors alone

    return value_now_called(key, value, allowed) or nearest(str(value), allowed)
