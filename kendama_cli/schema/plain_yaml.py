"""YAML of plain values: text, numbers, lists and groups with text as keys, of a size that a person could have written.

An alias stands for all that its anchor holds, so a few lines can mean more values than a machine has memory, or a value
that contains itself. Both are refused before anything is built; what cannot be said in JSON is, too.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

MAX_VALUES = 1_000_000
"""A primitive of thousands of numbers is read; 'billion laughs' is not."""
MAX_DEPTH = 50
MAX_BITS = 1023
"""Larger whole numbers are no floating-point numbers, and Python may refuse to show them."""


class TooMuchError(ValueError):
    """Error for a text whose content would not end, or would fill the memory."""


_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def load_yaml(text: str) -> Any:
    """Return the values in ``text``; raises ValueError, in one line, for anything but plain YAML."""
    check_yaml(text)
    try:
        value = yaml.load(text, Loader=_LOADER)
    except (yaml.YAMLError, ValueError, TypeError, AttributeError, OverflowError) as error:
        raise ValueError(_reason(error)) from None
    check_plain(value)
    return value


def check_yaml(text: str) -> None:
    """Raise TooMuchError where ``text`` is nested too deep, refers to itself or means too many values.

    Raises ValueError where it is no YAML.
    """
    sizes: dict[str, int] = {}
    open_values: list[tuple[str | None, int]] = [(None, 0)]  # anchor, and values before it, of each list or group
    values = 0
    try:
        event: Any
        for event in yaml.parse(text, Loader=_LOADER):
            line = event.start_mark.line + 1
            if isinstance(event, yaml.AliasEvent):
                if any(anchor == event.anchor for anchor, _ in open_values):
                    raise TooMuchError(f"line {line}: '*{event.anchor}' refers to what holds it")
                values += sizes.get(str(event.anchor), 0)
            elif isinstance(event, yaml.ScalarEvent | yaml.CollectionStartEvent):
                values += 1
                if isinstance(event, yaml.CollectionStartEvent):
                    open_values.append((event.anchor, values - 1))
                elif event.anchor:
                    sizes[event.anchor] = 1
            elif isinstance(event, yaml.CollectionEndEvent):
                anchor, before = open_values.pop()
                if anchor:
                    sizes[anchor] = values - before
            if values > MAX_VALUES or len(open_values) > MAX_DEPTH:
                limit = f"more than {MAX_VALUES} values" if values > MAX_VALUES else f"nested deeper than {MAX_DEPTH}"
                raise TooMuchError(f"line {line}: {limit}, aliases counted with what they stand for")
    except yaml.YAMLError as error:
        raise ValueError(_reason(error)) from None


def check_plain(value: Any, location: str = "") -> None:
    """Raise ValueError that names the first key that is no text or value that is not plain."""
    if isinstance(value, dict):
        for key, item in value.items():
            if not isinstance(key, str):
                inside = f"in '{location}' " if location else ""
                raise ValueError(f"the key {_shown(key)} {inside}is not text; quote it, or take a name")
            check_plain(item, f"{location}.{key}" if location else key)
    elif isinstance(value, list):
        for number, item in enumerate(value):
            check_plain(item, f"{location}[{number}]")
    elif isinstance(value, int) and value.bit_length() > MAX_BITS:
        raise ValueError(f"'{location}' is a whole number of more than 300 digits")
    elif isinstance(value, str):
        try:
            value.encode()
        except UnicodeEncodeError:
            raise ValueError(f"'{location}' is {_shown(value)}, which is not UTF-8 text") from None
    elif value is not None and not isinstance(value, bool | int | float):
        kind = "binary data" if isinstance(value, bytes) else f"a {type(value).__name__}"
        raise ValueError(f"'{location}' is {kind}; allowed: text, numbers, true, false, null, lists and groups")


def _shown(key: Any) -> str:
    text = repr(key)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _reason(error: Exception) -> str:
    mark = getattr(error, "problem_mark", None)
    if isinstance(error, yaml.YAMLError):
        where = "" if mark is None else f"line {mark.line + 1}: "
        problem = getattr(error, "problem", None) or " ".join(str(error).split()) or "unreadable"
        return f"{where}not YAML ({problem})"
    return str(error) or type(error).__name__


def scalars(path: Path) -> list[str]:
    """Return every text in the YAML file ``path``, keys too, as it is meant; nothing where it cannot be read."""
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
        return [event.value for event in yaml.parse(text, Loader=_LOADER) if isinstance(event, yaml.ScalarEvent)]
    except (OSError, yaml.YAMLError):
        return []
