"""Tables and lines fitted to the width of a terminal: broken between words, cut only with ``...``."""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Sequence
from typing import TextIO

GAP = "  "
CUT = "..."
WHOLE = 24
"""A cell that begins with a digit (a number with its unit or interval) is not broken up to so many characters."""


def terminal_columns(stream: TextIO | None = None) -> int:
    """Return the width of the terminal that ``stream`` (standard output) is, 0 where it is none: a pipe gets whole
    lines.
    """
    stream = stream or sys.stdout
    return shutil.get_terminal_size((0, 0)).columns if stream.isatty() else 0


def wrapped(text: str, width: int, *, cut: bool = False) -> list[str]:
    """Return ``text`` in lines of at most ``width`` characters.

    Lines end after a comma or semicolon where the parts are short, else between words, but not within a quotation or
    a command. A word longer than ``width`` is cut, or stays whole: a path can then be copied from the terminal.
    """
    if len(text) <= width:
        return [text]
    parts = re.split(r"(?<=[,;]) ", text)
    if max(map(len, parts)) > 0.7 * width:
        parts = [_cut(word, width) if cut else word for word in _words(text, width)]
    lines = [parts[0]]
    for part in parts[1:]:
        if len(lines[-1]) + 1 + len(part) > width:
            lines.append(part)
        else:
            lines[-1] += f" {part}"
    return lines


def _words(text: str, width: int) -> list[str]:
    """Return the words of ``text``; quotations and commands that fit in a line count as one."""
    phrases = re.findall(r"'[^']*'[^ ]*|kendama [^;,']*[^;,' ][;,]*|[^ ]+", text)
    return [word for phrase in phrases for word in ([phrase] if len(phrase) <= width else phrase.split(" "))]


def hanging(text: str, width: int) -> list[str]:
    """Return the lines of ``text``, each after the first under its indent and two blanks; a ``width`` of 0 breaks
    none.
    """
    if not width or len(text) <= width:
        return [text]
    indent = " " * (len(text) - len(text.lstrip()))
    first, *rest = wrapped(text.lstrip(), width - len(indent) - len(GAP))
    return [indent + first, *(indent + GAP + line for line in rest)]


def table_lines(
    rows: Sequence[Sequence[str]], head: Sequence[str] = (), *, width: int = 0, optional: Sequence[str] = ()
) -> list[str]:
    """Return the lines of a table in aligned columns; the last column is not padded.

    A table wider than ``width`` (0: any) loses columns without a value, breaks cells between words, loses the
    columns of ``optional`` (words of ``head``, the least important first), and continues below with the first column
    repeated, until it fits.
    """
    lines = [*([head] if head else []), *rows]
    if not lines:
        return []
    if not width or _total(_natural(lines)) <= width:
        return _aligned(lines, _natural(lines))
    kept = [i for i in range(len(lines[0])) if any(row[i] for row in rows)]
    for name in optional:
        if _fits(_chosen(lines, kept), width):
            break
        kept = [i for i in kept if not (head and head[i] == name)]
    made: list[str] = []
    for columns in _blocks(lines, kept, width):
        block = _chosen(lines, columns)
        made += [""] if made else []
        made += _aligned(block, _shrunk(block, width))
    return made


def _chosen(lines: Sequence[Sequence[str]], columns: Sequence[int]) -> list[list[str]]:
    return [[row[i] for i in columns] for row in lines]


def _natural(lines: Sequence[Sequence[str]]) -> list[int]:
    return [max(map(len, column)) for column in zip(*lines, strict=True)]


def _narrowest(lines: Sequence[Sequence[str]]) -> list[int]:
    """Return the width of the longest piece of each column that is not broken."""
    return [max(_unbroken(cell) for cell in column) for column in zip(*lines, strict=True)]


def _unbroken(cell: str) -> int:
    if len(cell) <= WHOLE and cell[:1].isdigit():
        return len(cell)
    return max(map(len, cell.split(" ")))


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + len(GAP) * (len(widths) - 1)


def _fits(lines: Sequence[Sequence[str]], width: int) -> bool:
    return _total(_narrowest(lines)) <= width


def _blocks(lines: Sequence[Sequence[str]], kept: Sequence[int], width: int) -> list[list[int]]:
    """Return the columns of each part of a table, of which all but the first begin with the first column again."""
    first, *others = kept
    blocks = [[first]]
    for column in others:
        if len(blocks[-1]) > 1 and not _fits(_chosen(lines, [*blocks[-1], column]), width):
            blocks.append([first])
        blocks[-1].append(column)
    return blocks


def _shrunk(lines: Sequence[Sequence[str]], width: int) -> list[int]:
    """Return widths that add up to ``width`` at most, taken from the widest column that can be broken; where words
    are too long for that, from the widest.
    """
    widths, narrowest = _natural(lines), _narrowest(lines)
    while _total(widths) > width:
        free = [i for i in range(len(widths)) if widths[i] > narrowest[i]] or range(len(widths))
        widths[max(free, key=widths.__getitem__)] -= 1
    return widths


def _aligned(lines: Sequence[Sequence[str]], widths: Sequence[int]) -> list[str]:
    made = []
    for row in lines:
        cells = [wrapped(cell, width, cut=True) for cell, width in zip(row, widths, strict=True)]
        for i in range(max(map(len, cells))):
            parts = [cell[i] if i < len(cell) else "" for cell in cells]
            made.append(GAP.join(part.ljust(width) for part, width in zip(parts, widths, strict=True)).rstrip())
    return made


def _cut(word: str, width: int) -> str:
    """Return a word that is longer than ``width`` with dots for its end."""
    return word if len(word) <= width else word[: max(width - len(CUT), 1)] + CUT
