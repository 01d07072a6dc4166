"""Checkpoints: numbered files of which the newest intact one counts; a torn or damaged one is passed over.

A checkpoint is one file: the state's arrays and JSON values, the random streams, and the name of the log so far.
The log grows, so it is kept in segments of its own, each written once.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.store import durable
from kendama_cli.store.codecs import pack_arrays, unpack_arrays

KEPT = 2
"""The newest, and one before it in case the newest is damaged later."""


@dataclass(frozen=True)
class Checkpoint:
    """One saved state: arrays and JSON values by name, random streams by purpose, the log's segments in order."""

    state: Mapping[str, Any]
    streams: Mapping[str, Any]
    segments: tuple[bytes, ...]


class CheckpointFolder:
    """The checkpoints of one computation."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._segments: list[str] = []
        self._number = 0

    def newest(self) -> Checkpoint | None:
        """The newest intact checkpoint; None where there is none. Saving goes on from there."""
        for path in sorted(self.folder.glob("*.ckpt"), reverse=True):
            found = self._read(path)
            if found is not None:
                self._number = int(path.stem)
                return found
        return None

    def discard(self) -> None:
        """Forget every checkpoint, so that the work begins from its start."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def save(self, state: Mapping[str, Any], streams: Mapping[str, Any], segment: bytes) -> None:
        """Keep ``state``, ``streams`` and the log's new ``segment``, durably on return."""
        self._number += 1
        if segment:
            name = durable.sha256(segment)
            durable.write_file(self.folder / f"{name}.log", segment)
            self._segments.append(name)
        arrays = {f"a.{name}": value for name, value in state.items() if isinstance(value, np.ndarray)}
        plain = {name: value for name, value in state.items() if not isinstance(value, np.ndarray)}
        meta = durable.canonical_json({"plain": plain, "streams": streams, "segments": self._segments})
        body = pack_arrays({**arrays, "meta": np.frombuffer(meta, dtype=np.uint8)})
        path = self.folder / f"{self._number:08d}.ckpt"
        durable.write_file(path, durable.sha256(body).encode() + body)
        for old in sorted(self.folder.glob("*.ckpt"))[:-KEPT]:
            old.unlink(missing_ok=True)

    def _read(self, path: Path) -> Checkpoint | None:
        try:
            data = path.read_bytes()
            seal, body = data[:64], data[64:]
            if durable.sha256(body).encode() != seal:
                return None
            arrays = unpack_arrays(body)
            meta = json.loads(arrays.pop("meta").tobytes())
            segments = tuple((self.folder / f"{name}.log").read_bytes() for name in meta["segments"])
        except (OSError, ValueError, KeyError):
            return None
        if any(durable.sha256(data) != name for data, name in zip(segments, meta["segments"], strict=True)):
            return None
        self._segments = list(meta["segments"])
        state = {**meta["plain"], **{name[2:]: value for name, value in arrays.items()}}
        return Checkpoint(state=state, streams=meta["streams"], segments=segments)
