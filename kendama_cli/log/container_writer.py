"""Writes the MCAP container by appending finished chunks, so that writing can go on after a kill.

Only the open chunk stands in memory; all others are in the file. Chunks end where their size says, never where a
checkpoint falls: equal messages give equal bytes.
"""

from __future__ import annotations

import json
import shutil
import struct
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import zstandard
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex, DataEnd, Header, Metadata, MetadataIndex

from kendama_cli.log.container_summary import MAGIC, Declarations, record_bytes, summary_and_footer

CHUNK_BYTES = 512 * 1024
"""A chunk ends with the message that brings it to this size."""
LIBRARY = "kendama"
FORMAT = 1
"""Of a log; it stands in the header beside the library's name."""
COMPRESSION = "zstd"

_COPIED_BYTES = 1 << 20
_RECORD = struct.Struct("<BQ")  # opcode, length of what follows
_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
_INDEX_HEAD = struct.Struct("<BQHI")  # opcode, length, channel, bytes of the entries
_INDEX_ENTRY = struct.Struct("<QQ")  # log time, offset in the chunk
_POSITION_HEAD = struct.Struct("<I")  # bytes of the JSON that stands before the open chunk


class AppendFile(Protocol):
    """A file that only grows, unless it is cut back to a size that it had."""

    def write(self, data: bytes, /) -> Any:
        """Append ``data``; a file that was neither written nor cut in this process begins anew."""

    def cut(self, size: int) -> None:
        """Keep the first ``size`` bytes."""

    def reader(self) -> BinaryIO:
        """Return the file's content, from its start."""


class ContainerWriter:
    """One MCAP file, appended chunk by chunk to ``file``."""

    def __init__(self, file: AppendFile) -> None:
        self._file = file
        self._size = self._crc = 0
        self._declared = Declarations()
        self._chunks: list[ChunkIndex] = []
        self._begin_chunk()

    @property
    def channels(self) -> dict[str, int]:
        """The id of every declared channel, by topic."""
        return self._declared.channel_ids()

    @property
    def messages_n(self) -> int:
        """Return how many messages were added, those before ``restore`` included."""
        return sum(self._declared.counts)

    def add_channel(self, topic: str, schema: str, descriptor_set: bytes) -> int:
        """Declare ``topic``; the id of its channel."""
        records = self._declared.declare(topic, schema, descriptor_set)
        self._open += record_bytes(records)
        return len(self._declared.counts)

    def add(self, channel: int, t_ns: int, data: bytes) -> None:
        """Append a message."""
        offset, counts = len(self._open), self._declared.counts
        length = _MESSAGE.size - _RECORD.size + len(data)
        self._open += _MESSAGE.pack(Opcode.MESSAGE, length, channel, counts[channel - 1], t_ns, t_ns)
        self._open += data
        counts[channel - 1] += 1
        self._index_message(channel, t_ns, offset)
        if len(self._open) >= CHUNK_BYTES:
            self._file.write(self._closed_chunk())

    def position(self) -> bytes:
        """Return where writing stands: how much of the file counts, its CRC, what is declared, and the open chunk."""
        head = {
            "size": self._size,
            "crc": self._crc,
            "declared": self._declared.to_json(),
            "chunks": [vars(index) for index in self._chunks],
        }
        plain = json.dumps(head, separators=(",", ":")).encode()
        return zstandard.compress(_POSITION_HEAD.pack(len(plain)) + plain + self._open)

    def restore(self, position: bytes) -> None:
        """Go on from ``position``; ValueError, with nothing changed, where the file lost what it counts on."""
        whole = zstandard.decompress(position)
        start = _POSITION_HEAD.size + _POSITION_HEAD.unpack_from(whole)[0]
        head = json.loads(whole[_POSITION_HEAD.size : start])
        if _crc_of(self._file.reader, head["size"]) != head["crc"]:
            raise ValueError(f"the first {head['size']} bytes of the log are not those that were written")
        self._file.cut(head["size"])
        self._size, self._crc = head["size"], head["crc"]
        self._declared = Declarations.from_json(head["declared"])
        self._chunks = [_chunk_index(index) for index in head["chunks"]]
        self._begin_chunk()
        self._open += whole[start:]
        offset = 0
        while offset < len(self._open):
            opcode, length = _RECORD.unpack_from(self._open, offset)
            if opcode == Opcode.MESSAGE:
                _, _, channel, _, t_ns, _ = _MESSAGE.unpack_from(self._open, offset)
                self._index_message(channel, t_ns, offset)
            offset += _RECORD.size + length

    def finish(self, target: BinaryIO, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Write the whole file to ``target``: all chunks, ``metadata``, summary and footer; nothing can follow.

        The appended file stays as it is, so that a run that is killed meanwhile can be restored.
        """
        if self._size:
            with self._file.reader() as source:
                shutil.copyfileobj(source, target, _COPIED_BYTES)
        target.write(self._closed_chunk())
        size, crc, indexes = self._size, self._crc, []
        for name, values in metadata.items():
            record = record_bytes([Metadata(name=name, metadata=dict(values))])
            indexes.append(MetadataIndex(offset=size, length=len(record), name=name))
            size, crc = size + len(record), zlib.crc32(record, crc)
            target.write(record)
        end = record_bytes([DataEnd(data_section_crc=crc)])
        target.write(end)
        target.write(summary_and_footer(size + len(end), self._declared, self._chunks, indexes))

    def _begin_chunk(self) -> None:
        self._open = bytearray()
        self._index: dict[int, bytearray] = {}
        self._times_ns: list[int] = []

    def _index_message(self, channel: int, t_ns: int, offset: int) -> None:
        entries = self._index.get(channel)
        if entries is None:
            entries = self._index[channel] = bytearray()
        entries += _INDEX_ENTRY.pack(t_ns, offset)
        self._times_ns.append(t_ns)

    def _closed_chunk(self) -> bytes:
        """Return what comes next in the file: the open chunk with its message indexes; a new one is begun."""
        beginning = b"" if self._size else MAGIC + record_bytes([Header(profile="", library=f"{LIBRARY} log {FORMAT}")])
        if not self._open:
            return self._counted(beginning)
        first_ns, last_ns = min(self._times_ns, default=0), max(self._times_ns, default=0)
        packed = zstandard.compress(bytes(self._open))
        chunk = Chunk(
            compression=COMPRESSION,
            data=packed,
            message_start_time=first_ns,
            message_end_time=last_ns,
            uncompressed_crc=zlib.crc32(self._open),
            uncompressed_size=len(self._open),
        )
        start = self._size + len(beginning)
        record = record_bytes([chunk])
        offsets: dict[int, int] = {}
        indexes = bytearray()
        for channel, entries in sorted(self._index.items()):
            offsets[channel] = start + len(record) + len(indexes)
            length = _INDEX_HEAD.size - _RECORD.size + len(entries)
            indexes += _INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, length, channel, len(entries)) + entries
        self._chunks.append(
            ChunkIndex(
                chunk_start_offset=start,
                chunk_length=len(record),
                compression=COMPRESSION,
                compressed_size=len(packed),
                uncompressed_size=len(self._open),
                message_start_time=first_ns,
                message_end_time=last_ns,
                message_index_length=len(indexes),
                message_index_offsets=offsets,
            )
        )
        self._begin_chunk()
        return self._counted(beginning + record + indexes)

    def _counted(self, data: bytes) -> bytes:
        self._size += len(data)
        self._crc = zlib.crc32(data, self._crc)
        return data


def is_whole(position: bytes, path: Path) -> bool:
    """Return True if the file ``path`` still has what the log at ``position`` had written to it."""
    whole = zstandard.decompress(position)
    head = json.loads(whole[_POSITION_HEAD.size : _POSITION_HEAD.size + _POSITION_HEAD.unpack_from(whole)[0]])
    return bool(_crc_of(lambda: path.open("rb"), head["size"]) == head["crc"])


def _crc_of(reader: Callable[[], BinaryIO], size: int) -> int | None:
    """Return the CRC of the first ``size`` bytes; None where there are fewer or none can be read."""
    crc, left = 0, size
    try:
        with reader() as stream:
            while left:
                part = stream.read(min(left, _COPIED_BYTES))
                if not part:
                    return None
                crc, left = zlib.crc32(part, crc), left - len(part)
    except OSError:
        return None if size else 0
    return crc


def _chunk_index(values: Mapping[str, Any]) -> ChunkIndex:
    offsets = {int(channel): offset for channel, offset in values["message_index_offsets"].items()}
    return ChunkIndex(**{**values, "message_index_offsets": offsets})
