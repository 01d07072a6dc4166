"""Checkpoints: numbered files of which the newest intact one counts; a torn or damaged one is passed over.

A checkpoint is one file: the state's arrays and JSON values, the random streams, and where the log stood. The log
itself grows in a file beside the checkpoints.
"""

from __future__ import annotations

import json
import shutil
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.store import durable
from kendama_cli.store.codecs import pack_arrays, unpack_arrays

KEPT = 2
"""The newest, and one before it in case the newest is damaged later."""

_DIGEST_BYTES = 64
_LOG_BYTES = struct.Struct("<Q")


@dataclass(frozen=True)
class Checkpoint:
    """One saved state: arrays and JSON values by name, random streams by purpose, the log's position."""

    state: Mapping[str, Any]
    streams: Mapping[str, Any]
    log: bytes


class CheckpointFolder:
    """The checkpoints of one computation."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._number = 0

    @property
    def log_path(self) -> Path:
        """Where the log grows that the checkpoints count on."""
        return self.folder / "log.part"

    def intact(self) -> Iterator[Checkpoint]:
        """The intact checkpoints, newest first; saving goes on from the last one that was taken."""
        for path in sorted(self.folder.glob("*.ckpt"), reverse=True):
            found = _read(path)
            if found is not None:
                self._number = int(path.stem)
                yield found

    def discard(self) -> None:
        """Forget every checkpoint, so that the work begins from its start."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def discard_unless_saved(self) -> None:
        """Leave nothing where there is no checkpoint that could be gone on from."""
        if not any(self.folder.glob("*.ckpt")):
            self.discard()

    def save(self, state: Mapping[str, Any], streams: Mapping[str, Any], log: bytes) -> None:
        """Keep ``state``, ``streams`` and the position of the log, durably on return."""
        self._number += 1
        arrays = {f"a.{name}": value for name, value in state.items() if isinstance(value, np.ndarray)}
        plain = {name: value for name, value in state.items() if not isinstance(value, np.ndarray)}
        meta = durable.canonical_json({"plain": plain, "streams": streams})
        body = log + pack_arrays({**arrays, "meta": np.frombuffer(meta, dtype=np.uint8)})
        head = _LOG_BYTES.pack(len(log))
        path = self.folder / f"{self._number:08d}.ckpt"
        durable.write_file(path, durable.sha256(head + body).encode() + head + body)
        for old in sorted(self.folder.glob("*.ckpt"))[:-KEPT]:
            old.unlink(missing_ok=True)


def _read(path: Path) -> Checkpoint | None:
    """The checkpoint at ``path``; None where it cannot be read or a byte of it is not as it was written."""
    try:
        data = path.read_bytes()
        digest, content = data[:_DIGEST_BYTES], data[_DIGEST_BYTES:]
        if durable.sha256(content).encode() != digest:
            return None
        end = _LOG_BYTES.size + _LOG_BYTES.unpack_from(content)[0]
        arrays = unpack_arrays(content[end:])
        meta = json.loads(arrays.pop("meta").tobytes())
    except (OSError, ValueError, KeyError):
        return None
    state = {**meta["plain"], **{name[2:]: value for name, value in arrays.items()}}
    return Checkpoint(state=state, streams=meta["streams"], log=content[_LOG_BYTES.size : end])
