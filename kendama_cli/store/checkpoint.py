"""Checkpoints: numbered files of which the newest intact one counts; a torn or damaged one is passed over.

A checkpoint is one file: a digest of what follows, its format, the state's arrays and JSON values, the random streams,
and where the log stood. The log itself grows in a file beside the checkpoints.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from kendama_cli.errors import FormatError, StoreError
from kendama_cli.schema.unpacking import unpacked_arrays
from kendama_cli.store import durable
from kendama_cli.store.codecs import pack_arrays
from kendama_cli.system.interface import share_with_group


class DurableAppendFile:
    """Begins anew with the first write unless it was cut: what a killed run left beyond its checkpoint is gone.

    Every method raises StoreError where the disk refuses, but ``reader``, which raises OSError.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: io.FileIO | None = None
        self._unsynced = False

    def write(self, data: bytes) -> None:
        """Append ``data``."""
        file = self._file or self._open("w")
        self._unsynced = True
        left = memoryview(data)
        with durable.plain_disk_errors(self.path):
            while left:
                left = left[file.write(left) :]

    def sync(self) -> None:
        """Flush all that was written to the disk."""
        if self._file is None or not self._unsynced:
            return
        with durable.plain_disk_errors(self.path):
            os.fsync(self._file.fileno())
            durable.sync(self.path.parent)
        self._unsynced = False

    def cut(self, size: int) -> None:
        """Keep the first ``size`` bytes."""
        file = self._file or self._open("r+" if self.path.exists() else "w")
        with durable.plain_disk_errors(self.path):
            file.truncate(size)
            file.seek(size)

    def reader(self) -> BinaryIO:
        """Return the file's content, from its start."""
        return self.path.open("rb")

    def close(self) -> None:
        """Let go of the file; it stays where it is."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _open(self, mode: str) -> io.FileIO:
        durable.make_folder(self.path.parent)
        with durable.plain_disk_errors(self.path):
            self._file = io.FileIO(self.path, mode)
            share_with_group(self.path)
        return self._file


KEPT = 2
"""The newest, and one before it in case the newest is damaged later."""

_DIGEST_BYTES = 64
_HEAD = struct.Struct("<IQ")  # format, bytes of the log's position
FORMAT = 1
LOG_PART = "log.part"


@dataclass(frozen=True)
class Checkpoint:
    """One saved state: arrays and JSON values by name, random streams by purpose, the log's position."""

    state: Mapping[str, Any]
    streams: Mapping[str, Any]
    log: bytes


class CheckpointFolder:
    """The checkpoints of one computation; every method raises StoreError where the disk refuses."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._number: int | None = None

    @property
    def log_path(self) -> Path:
        """Return the location of the growing log that the checkpoints rely on."""
        return self.folder / LOG_PART

    def intact(self) -> Iterator[Checkpoint]:
        """Yield the intact checkpoints, newest first.

        Raises StoreError where one cannot be read now, FormatError where it is of another format.
        """
        for path in reversed(self.files()):
            found = read_checkpoint(path)
            if found is not None:
                yield found

    def files(self) -> list[Path]:
        """Return the checkpoints' files, intact or not, oldest first."""
        return checkpoint_files(self.folder)

    def discard(self) -> None:
        """Forget every checkpoint, so that the work begins from its start."""
        if durable.exists(self.folder):
            durable.remove(self.folder)

    def discard_unless_saved(self) -> None:
        """Leave nothing where there is no checkpoint to resume from."""
        with contextlib.suppress(StoreError):  # what is left is collected as garbage
            if not self.files():
                self.discard()

    def save(self, state: Mapping[str, Any], streams: Mapping[str, Any], log: bytes) -> None:
        """Keep ``state``, ``streams`` and the position of the log, durably on return."""
        if self._number is None:  # after all that stand there: a damaged one must not pass for the newest
            self._number = max((int(path.stem) for path in self.files()), default=0)
        self._number += 1
        arrays = {f"a.{name}": value for name, value in state.items() if isinstance(value, np.ndarray)}
        plain = {name: value for name, value in state.items() if not isinstance(value, np.ndarray)}
        meta = durable.canonical_json({"plain": plain, "streams": streams})
        body = log + pack_arrays({**arrays, "meta": np.frombuffer(meta, dtype=np.uint8)})
        head = _HEAD.pack(FORMAT, len(log))
        path = self.folder / f"{self._number:08d}.ckpt"
        durable.write_file(path, durable.sha256(head + body).encode() + head + body)
        for old in self.files()[:-KEPT]:
            durable.remove(old)


def checkpoint_files(folder: Path) -> list[Path]:
    """Return the files of checkpoints in ``folder``, intact or not, oldest first."""
    return [path for path in durable.listed(folder) if path.suffix == ".ckpt" and path.stem.isdecimal()]


def read_checkpoint(path: Path) -> Checkpoint | None:
    """Return the checkpoint at ``path``; None if there is none or a byte of it has changed since it was written.

    Raises StoreError where it cannot be read now, FormatError where it is whole and of another format.
    """
    data = durable.read_file(path) or b""
    digest, content = data[:_DIGEST_BYTES], data[_DIGEST_BYTES:]
    if len(content) < _HEAD.size or durable.sha256(content).encode() != digest:
        return None
    number, log_bytes = _HEAD.unpack_from(content)
    if number != FORMAT:
        raise FormatError(str(path), "a checkpoint", number, FORMAT)
    end = _HEAD.size + log_bytes
    try:
        arrays = unpacked_arrays(content[end:])
        meta = json.loads(arrays.pop("meta").tobytes())
    except (ValueError, KeyError):
        return None
    state = {**meta["plain"], **{name[2:]: value for name, value in arrays.items()}}
    return Checkpoint(state=state, streams=meta["streams"], log=content[_HEAD.size : end])
