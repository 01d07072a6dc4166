"""Writes a stage's log: messages in memory, segments for checkpoints, one deterministic MCAP file at the end."""

from __future__ import annotations

import hashlib
import json
import math
import os
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import zstandard
from mcap.writer import CompressionType, Writer

from kendama_cli.log.channels import schema_of
from kendama_cli.schema.messages import LogSchemaError, encode, file_descriptor_set

STAGE_METADATA = "kendama.stage"
"""The MCAP metadata record with the keys stage, settings and metrics (both canonical JSON)."""

_LIBRARY = "kendama"
_CHUNK_BYTES = 512 * 1024
_SEGMENT_MAGIC = b"KLOG\x01"
_HEADER = struct.Struct("<HqI")  # topic number, t_ns, length of the message
_DIGEST_BYTES = 32


class McapLog:
    """The LogWriter of a running stage; times are simulated or recorded time, never the wall clock."""

    def __init__(self) -> None:
        self._messages: list[tuple[str, int, bytes]] = []
        self._schemas: dict[str, str] = {}
        self._saved = 0

    def __len__(self) -> int:
        """How many messages were written or restored."""
        return len(self._messages)

    def write(self, topic: str, t_s: float, message: Mapping[str, Any]) -> None:
        """Append one message at time ``t_s`` >= 0; LogSchemaError for what the closed tables do not have."""
        schema = self._schemas.get(topic)
        if schema is None:
            schema = self._schemas[topic] = schema_of(topic)
        if not 0.0 <= t_s < 9.2e9:
            raise LogSchemaError(f"topic '{topic}': time must be finite and not negative, not {t_s!r} s")
        t_ns = round(t_s * 1e9)
        try:
            self._messages.append((topic, t_ns, encode(schema, message, t_ns)))
        except LogSchemaError as wrong:
            raise LogSchemaError(f"topic '{topic}': {wrong}") from None

    def segment(self) -> bytes:
        """The messages since the last segment as self-checking bytes, to be kept with a checkpoint.

        Layout: magic, SHA-256 of the rest, then zstd of: length of a JSON list of topics, the list, and per message
        topic number, t_ns and length (little-endian) before its bytes.
        """
        fresh = self._messages[self._saved :]
        self._saved = len(self._messages)
        number = {topic: n for n, topic in enumerate(sorted({topic for topic, _, _ in fresh}))}
        topics = json.dumps(list(number)).encode()
        parts = [struct.pack("<I", len(topics)), topics]
        for topic, t_ns, data in fresh:
            parts.append(_HEADER.pack(number[topic], t_ns, len(data)))
            parts.append(data)
        packed = zstandard.ZstdCompressor(level=3, write_checksum=False).compress(b"".join(parts))
        return _SEGMENT_MAGIC + hashlib.sha256(packed).digest() + packed

    def load_segment(self, segment: bytes) -> None:
        """Append the messages of a segment; ValueError, with nothing appended, where a byte of it is damaged."""
        start = len(_SEGMENT_MAGIC)
        digest, packed = segment[start : start + _DIGEST_BYTES], segment[start + _DIGEST_BYTES :]
        if segment[:start] != _SEGMENT_MAGIC or hashlib.sha256(packed).digest() != digest:
            raise ValueError(f"the log segment of {len(segment)} bytes is damaged: its digest does not match")
        plain = zstandard.ZstdDecompressor().decompress(packed)
        offset = 4 + struct.unpack_from("<I", plain)[0]
        topics = json.loads(plain[4:offset])
        while offset < len(plain):
            topic, t_ns, length = _HEADER.unpack_from(plain, offset)
            offset += _HEADER.size
            self._messages.append((topics[topic], t_ns, plain[offset : offset + length]))
            offset += length
        self._saved = len(self._messages)

    def finish(self, path: Path | str, *, stage: str, settings: Mapping[str, Any], metrics: Mapping[str, Any]) -> None:
        """Write all messages in order of time (equal times: of writing) to ``path``.

        Equal messages, settings and metrics give equal bytes: no host, date or folder enters the file, and of an
        absolute path among the settings only the file's name stays. Raises OSError where the disk refuses.
        """
        with Path(path).open("wb") as file:
            writer: Any = Writer(
                file, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD, enable_crcs=True, enable_data_crcs=True
            )
            writer.start(profile="", library=_LIBRARY)
            channel = self._register(writer)
            sequence = dict.fromkeys(channel, 0)
            for topic, t_ns, data in sorted(self._messages, key=lambda message: message[1]):
                writer.add_message(channel[topic], t_ns, data, t_ns, sequence[topic])
                sequence[topic] += 1
            facts = {"stage": stage, "settings": canonical_json(settings), "metrics": canonical_json(metrics)}
            writer.add_metadata(STAGE_METADATA, dict(sorted(facts.items())))
            writer.finish()

    def _register(self, writer: Writer) -> dict[str, int]:
        """Register schemas and channels, sorted by name; topic -> channel id."""
        topics = sorted({topic for topic, _, _ in self._messages})
        schema = {
            name: writer.register_schema(name, "protobuf", file_descriptor_set(name))
            for name in sorted({schema_of(topic) for topic in topics})
        }
        return {topic: writer.register_channel(topic, "protobuf", schema[schema_of(topic)]) for topic in topics}


def canonical_json(value: Any) -> str:
    """JSON with sorted keys and no spaces; numbers that are not finite become null, absolute paths their last part."""
    return json.dumps(_plain(value), sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, str):
        return Path(value).name if os.path.isabs(value) else value
    if hasattr(value, "tolist"):  # a numpy scalar or array
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
