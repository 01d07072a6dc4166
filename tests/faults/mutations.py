"""Spoils files and texts as disks, editors, scripts and people do; the same seed spoils the same way."""

from __future__ import annotations

import random
import re

NUMBER = re.compile(rb"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[A-Za-z_][\w./-]*")
NUMBERS = (
    *(
        b"nan",
        b"inf",
        b"-inf",
        b"1e300",
        b"-1e300",
        b"1e-300",
        b"0",
        b"-1",
        b"-0.0",
        b"1e999",
        b"0x10",
        b"1_000",
        b"07",
    ),
    *(b"9223372036854775808", b"1" * 400, b"", b"1.5.5", b"1,5", b"true", b"null", b"[]", b"{}", b"''", b"1e", b"2:30"),
)
PIECES = (
    *(b"{", b"}", b"[", b"]", b":", b",", b"\n", b"\t", b"'", b'"', b"#", b"&a ", b"*a", b"!!binary ", b"- ", b"? "),
    *(
        b"\x00",
        b"\xff\xfe",
        b"\xc3",
        "é\u2028".encode(),
        b"\r\n",
        b"%s",
        b"${seed}",
        b"${",
        b"<<: ",
        b"---\n",
        b"| ",
        b"> ",
    ),
    *(
        b"!!python/object/apply:os.getcwd []",
        b"<!DOCTYPE a>",
        b"<a/>",
        b"&lt;",
        b"../",
        b"null",
        b"true",
        b"2026-01-01",
    ),
    *(b"[" * 60, b"{a: " * 60, b"=", b"~", b"+", b"@", b"1: 2\n", b"*" * 30, b"\\", b"\\u0000", b"%"),
)


def mutated(data: bytes, rng: random.Random) -> bytes:
    """``data`` spoiled in one to four places."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        data = rng.choice(_WAYS)(data, rng)
    return data[: 1 << 20]


def _span(data: bytes, rng: random.Random) -> tuple[int, int]:
    start = rng.randrange(len(data) + 1)
    return start, min(len(data), start + rng.choice((1, 1, 4, 20, 200, len(data))))


def _flip(data: bytes, rng: random.Random) -> bytes:
    if not data:
        return data
    place = rng.randrange(len(data))
    return data[:place] + bytes([data[place] ^ (1 << rng.randrange(8))]) + data[place + 1 :]


def _delete(data: bytes, rng: random.Random) -> bytes:
    start, end = _span(data, rng)
    return data[:start] + data[end:]


def _repeat(data: bytes, rng: random.Random) -> bytes:
    start, end = _span(data, rng)
    return data[:end] + data[start:end] * rng.choice((1, 2, 50)) + data[end:]


def _insert(data: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(data) + 1)
    return data[:place] + rng.choice(PIECES) + data[place:]


def _random(data: bytes, rng: random.Random) -> bytes:
    start, end = _span(data, rng)
    return data[:start] + rng.randbytes(min(64, end - start)) + data[end:]


def _cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _number(data: bytes, rng: random.Random) -> bytes:
    found = list(NUMBER.finditer(data))
    if not found:
        return _insert(data, rng)
    one = rng.choice(found)
    return data[: one.start()] + rng.choice(NUMBERS) + data[one.end() :]


def _word(data: bytes, rng: random.Random) -> bytes:
    found = list(WORD.finditer(data))
    if not found:
        return _insert(data, rng)
    one, other = rng.choice(found), rng.choice(found)
    return (
        data[: one.start()] + rng.choice((other[0], b"", rng.choice(NUMBERS), rng.choice(PIECES))) + data[one.end() :]
    )


def _line(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    one = rng.randrange(len(lines))
    way = rng.randrange(4)
    if way == 0:
        del lines[one]
    elif way == 1:
        lines.insert(rng.randrange(len(lines) + 1), lines[one])
    elif way == 2:
        lines[one] = b"  " + lines[one]
    else:
        rng.shuffle(lines)
    return b"\n".join(lines)


_WAYS = (_flip, _delete, _repeat, _insert, _random, _cut, _number, _number, _number, _word, _word, _line)
