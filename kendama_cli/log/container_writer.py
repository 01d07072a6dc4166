"""A log that grows: messages appended to a file in compressed pieces, so that writing can go on after a kill.

Only the open piece stands in memory; all others are in the file, each behind its size. Pieces end where their size
says, never where a checkpoint falls, and mcap's own writer makes the container of them at the end: equal messages give
equal bytes.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import zstandard
from mcap.writer import Writer

CHUNK_BYTES = 512 * 1024
"""A piece, and a chunk of the container, ends with the message that brings it to this size."""
LIBRARY = "kendama"
FORMAT = 1
"""Of a log; it stands in the header beside the library's name."""
ENCODING = "protobuf"

_COPIED_BYTES = 1 << 20
_MESSAGE = struct.Struct("<HQI")  # channel, time, bytes of the data
_SIZE = struct.Struct("<I")  # bytes of a piece, and of the JSON that stands before the open piece in a position


class AppendFile(Protocol):
    """A file that only grows, unless it is cut back to a size that it had."""

    def write(self, data: bytes, /) -> Any:
        """Append ``data``; a file that was neither written nor cut in this process begins anew."""

    def cut(self, size: int) -> None:
        """Keep the first ``size`` bytes."""

    def reader(self) -> BinaryIO:
        """Return the file's content, from its start."""


class ContainerWriter:
    """One log, appended piece by piece to ``file``."""

    def __init__(self, file: AppendFile) -> None:
        self._file = file
        self._size = self._crc = self.messages_n = 0
        self._declared: dict[str, tuple[str, str]] = {}  # schema and descriptor set, in hexadecimal, by topic
        self._open = bytearray()

    @property
    def channels(self) -> dict[str, int]:
        """Return the id of every declared channel, by topic."""
        return {topic: number for number, topic in enumerate(self._declared, start=1)}

    def add_channel(self, topic: str, schema: str, descriptor_set: bytes) -> int:
        """Declare ``topic`` and return the id of its channel."""
        self._declared[topic] = schema, descriptor_set.hex()
        return len(self._declared)

    def add(self, channel: int, t_ns: int, data: bytes) -> None:
        """Append a message."""
        self._open += _MESSAGE.pack(channel, t_ns, len(data))
        self._open += data
        self.messages_n += 1
        if len(self._open) >= CHUNK_BYTES:
            packed = zstandard.compress(bytes(self._open))
            piece = _SIZE.pack(len(packed)) + packed
            self._file.write(piece)
            self._size, self._crc = self._size + len(piece), zlib.crc32(piece, self._crc)
            self._open = bytearray()

    def position(self) -> bytes:
        """Return the state of writing: how much of the file counts, its CRC, what is declared, and the open piece."""
        head = {"size": self._size, "crc": self._crc, "messages": self.messages_n, "declared": self._declared}
        plain = json.dumps(head, separators=(",", ":")).encode()
        return zstandard.compress(_SIZE.pack(len(plain)) + plain + self._open)

    def restore(self, position: bytes) -> None:
        """Go on from ``position``; ValueError, with nothing changed, where the file lost what it counts on."""
        head, rest = _read(position)
        if _crc_of(self._file.reader, head["size"]) != head["crc"]:
            raise ValueError(f"the first {head['size']} bytes of the log are not those that were written")
        self._file.cut(head["size"])
        self._size, self._crc, self.messages_n = head["size"], head["crc"], head["messages"]
        self._declared = {topic: (schema, data) for topic, (schema, data) in head["declared"].items()}
        self._open = bytearray(rest)

    def finish(self, target: BinaryIO, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Write all messages, ``metadata``, summary and footer to ``target``; nothing can follow.

        The appended file stays as it is, so that a run that is killed meanwhile can be restored.
        """
        writer: Any = Writer(target, chunk_size=CHUNK_BYTES, enable_data_crcs=True)
        writer.start(library=f"{LIBRARY} log {FORMAT}")
        schemas: dict[tuple[str, str], int] = {}
        for topic, found in self._declared.items():
            if found not in schemas:
                schemas[found] = writer.register_schema(found[0], ENCODING, bytes.fromhex(found[1]))
            writer.register_channel(topic, ENCODING, schemas[found])
        counts = [0] * (len(self._declared) + 1)
        for channel, t_ns, data in self._messages():
            writer.add_message(channel, t_ns, data, t_ns, counts[channel])
            counts[channel] += 1
        for name, values in metadata.items():
            writer.add_metadata(name, dict(values))
        writer.finish()

    def _messages(self) -> Iterator[tuple[int, int, bytes]]:
        """Yield channel, time and data of every message, in the order of writing."""
        if self._size:
            with self._file.reader() as source:
                while head := source.read(_SIZE.size):
                    yield from _messages_in(zstandard.decompress(source.read(*_SIZE.unpack(head))))
        yield from _messages_in(bytes(self._open))


def is_whole(position: bytes, path: Path) -> bool:
    """Return True if the file ``path`` still has what the log at ``position`` had written to it."""
    head, _ = _read(position)
    return bool(_crc_of(lambda: path.open("rb"), head["size"]) == head["crc"])


def _read(position: bytes) -> tuple[dict[str, Any], bytes]:
    """Return the head of a position and the open piece behind it."""
    whole = zstandard.decompress(position)
    start = _SIZE.size + _SIZE.unpack_from(whole)[0]
    return json.loads(whole[_SIZE.size : start]), whole[start:]


def _messages_in(piece: bytes) -> Iterator[tuple[int, int, bytes]]:
    offset = 0
    while offset < len(piece):
        channel, t_ns, length = _MESSAGE.unpack_from(piece, offset)
        offset += _MESSAGE.size + length
        yield channel, t_ns, piece[offset - length : offset]


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
