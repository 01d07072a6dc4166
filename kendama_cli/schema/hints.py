"""Hints on a name that does not exist: its name of today, or the one that is spelled nearest.

Standard library only, and the table of names that changed is read in errors alone.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from kendama_cli.errors import ConfigError


def nearest(word: str, candidates: Iterable[str], before: str = "") -> str:
    """Return ``, did you mean '...'?`` for the closest candidate, typed after ``before``, or an empty string.

    Upper and lower case are alike.
    """
    known = {one.casefold(): one for one in candidates}
    close = difflib.get_close_matches(word.casefold(), known, n=1, cutoff=0.6)
    return f", did you mean '{before}{known[close[0]]}'?" if close else ""


def listed(problem: str, hint: str, options: Iterable[str], what: str = "allowed") -> str:
    """Return an error that says ``problem``, then the ``hint``, and ``what`` there is at the end."""
    before = f"? {what.capitalize()}" if hint.endswith("?") else f"; {what}"
    return f"{problem}{hint.removesuffix('?')}{before}: {', '.join(options) or 'none'}"


def unknown_key(key: str, siblings: Iterable[str], below: Iterable[str] = ()) -> ConfigError:
    """Return the error for a key that the schema does not have; ``below`` are dotted names beneath the siblings.

    The hint is the key's name of today where it had another, else the sibling that is spelled nearest, else what
    beneath one has the nearest last word.
    """
    from kendama_cli.schema.renames import new_key, now_called  # noqa: PLC0415 - a table that is read in errors alone

    if (new := new_key(key)) != key:
        return ConfigError(key, f"unknown key '{key}'{now_called(key, new)}")
    prefix, _, name = key.rpartition(".")
    location = f"{prefix}." if prefix else ""
    known = sorted(siblings)
    # the last word is what was mistyped: comparing whole paths would find every sibling alike
    same = [one for one in known if one.casefold() == name.casefold()]
    close = same or difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    if not close:
        by_word = {path.rpartition(".")[2]: path for path in sorted(below, reverse=True)}
        close = [by_word[word] for word in difflib.get_close_matches(name, by_word, n=1, cutoff=0.75)]
    hint = (
        f", did you mean '{location}{close[0]}'?"
        if close
        else "; allowed here: " + ", ".join(location + word for word in known)
    )
    return ConfigError(key, f"unknown key '{key}'{hint}")


def value_hint(key: str, value: object, allowed: Iterable[str], typed: str | None = None) -> str:
    """Return what a wrong value is called today, where it had another name, else the nearest that is allowed.

    ``typed`` is the key as it is typed before the value: a group's has slashes.
    """
    from kendama_cli.schema.renames import near_old_value, value_now_called  # noqa: PLC0415 - a table that is read in errors alone

    names, before = list(allowed), f"{typed or key}="
    near = value_now_called(key, value, names) or nearest(str(value), names, before)
    return near or nearest(near_old_value(key, value), names, before)
