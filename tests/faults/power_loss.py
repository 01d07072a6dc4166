"""Content of a disk after a power loss: what was synchronised for certain, and of the rest whatever.

A folder's names and a file's bytes are durable on their own, each by an fsync of it; a rename is all or nothing. That
is what POSIX promises, and less than ext4, xfs or btrfs do.
"""

from __future__ import annotations

import os
import random
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

_HEAD = struct.Struct("<cIII")


class Record(NamedTuple):
    """One thing that happened: what, to which path, and with what."""

    what: str
    path: str
    other: str
    data: bytes


@dataclass
class File:
    """A file's bytes: those that are read back now, and those that survive."""

    live: bytes = b""
    synced: bytes = b""


@dataclass
class Folder:
    """A folder's names: those that are read back now, and those that survive."""

    live: dict[str, File | Folder] = field(default_factory=dict)
    synced: dict[str, File | Folder] = field(default_factory=dict)

    def write(self, place: Path) -> None:
        """Make what is live so at ``place``."""
        place.mkdir(parents=True)
        for name, node in self.live.items():
            if isinstance(node, Folder):
                node.write(place / name)
            else:
                (place / name).write_bytes(node.live)


def read_journal(data: bytes) -> list[Record]:
    """What the shim and the driver wrote down, in order."""
    records, at = [], 0
    while at < len(data):
        what, *lengths = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        parts = []
        for length in lengths:
            parts.append(data[at : at + length])
            at += length
        records.append(Record(what.decode(), parts[0].decode(), parts[1].decode(), parts[2]))
    return records


def losses(
    before: Path, home: Path, records: Sequence[Record], seed: int
) -> Iterator[tuple[str, tuple[Folder, list[str]]]]:
    """What may be left of ``home``, which was as ``before`` on the disk, after ``records``, and what had been told."""
    rng = random.Random(seed)
    told = [record.path for record in records if record.what == "T"]
    for variant in ("only what was synchronised", "names without bytes", "bytes cut in half", "any of it"):
        root = _on_disk(before)
        for record in records:
            _happen(root, home, record)
        yield variant, (_left(root, variant, rng), told)


def _on_disk(place: Path) -> Folder:
    names: dict[str, File | Folder] = {
        path.name: _on_disk(path) if path.is_dir() else File(path.read_bytes(), path.read_bytes())
        for path in place.iterdir()
    }
    return Folder(names, dict(names))


def _happen(root: Folder, home: Path, record: Record) -> None:
    if record.what == "T":
        return
    inside = Path(record.path).relative_to(home).parts
    if record.what == "s":
        _synchronise(root, _node(root, inside))
        return
    parent, name = _folder(root, inside[:-1]), inside[-1]
    if record.what in "ct":
        node = parent.live.setdefault(name, File())
        assert isinstance(node, File)
        node.live = b"" if record.what == "t" else node.live
    elif record.what == "m":
        parent.live[name] = Folder()
    elif record.what == "u":
        del parent.live[name]
    elif record.what == "r":
        target = Path(record.other).relative_to(home).parts
        _folder(root, target[:-1]).live[target[-1]] = parent.live.pop(name)
    else:
        node, place = parent.live[name], int(record.other)
        assert isinstance(node, File)
        after = b"" if record.what == "f" else node.live[place + len(record.data) :]
        node.live = node.live[:place].ljust(place, b"\0") + record.data + after


def _synchronise(root: Folder, node: File | Folder) -> None:
    if isinstance(node, File):
        node.synced = node.live
        return
    arrived = [one for one in node.live.values() if not any(one is other for other in node.synced.values())]
    node.synced = dict(node.live)
    for folder in _folders(root):  # a rename takes the name from where it was as it gives it here
        if folder is not node:
            folder.synced = {
                name: one
                for name, one in folder.synced.items()
                if folder.live.get(name) is one or not any(one is new for new in arrived)
            }


def _left(folder: Folder, variant: str, rng: random.Random) -> Folder:
    only = variant == "only what was synchronised"
    names = folder.synced if only or (variant == "any of it" and rng.random() < 0.5) else folder.live
    left = Folder()
    for name, node in names.items():
        if isinstance(node, Folder):
            left.live[name] = _left(node, variant, rng)
        elif variant == "bytes cut in half" and node.live != node.synced:
            # what is appended, or cut off, loses none of the durable bytes before it
            kept = len(os.path.commonprefix((node.live, node.synced)))  # noqa: RUF071 - bytes, no paths
            left.live[name] = File(node.live[: max(kept, len(node.live) // 2)])
        else:
            left.live[name] = File(node.live if variant == "any of it" and rng.random() < 0.5 else node.synced)
    return left


def _folders(folder: Folder) -> Iterator[Folder]:
    yield folder
    seen = {id(node): node for names in (folder.live, folder.synced) for node in names.values()}
    for node in seen.values():
        if isinstance(node, Folder):
            yield from _folders(node)


def _node(root: Folder, parts: Sequence[str]) -> File | Folder:
    node: File | Folder = root
    for part in parts:
        assert isinstance(node, Folder)
        node = node.live[part]
    return node


def _folder(root: Folder, parts: Sequence[str]) -> Folder:
    node = _node(root, parts)
    assert isinstance(node, Folder)
    return node
