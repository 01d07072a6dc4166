"""Declarations and counts of an MCAP file, and the summary at its end."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    Footer,
    McapRecord,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

MAGIC = b"\x89MCAP0\r\n"
ENCODING = "protobuf"

_FOOTER = struct.Struct("<BQQQ")  # opcode, length, start of the summary and of its offsets: what the CRC covers
_FOOTER_BYTES = 20


def record_bytes(records: Iterable[McapRecord]) -> bytes:
    """``records`` one after the other."""
    builder: Any = RecordBuilder()
    for record in records:
        record.write(builder)
    data: bytes = builder.end()
    return data


@dataclass
class Declarations:
    """Schemas and channels by their places (ids count from 1), and how many messages each channel has."""

    schemas: list[tuple[str, bytes]] = field(default_factory=list)
    """name and descriptor set"""
    channels: list[tuple[str, int]] = field(default_factory=list)
    """topic and schema id"""
    counts: list[int] = field(default_factory=list)

    def channel_ids(self) -> dict[str, int]:
        """Channel ids by topic."""
        return {topic: number for number, (topic, _) in enumerate(self.channels, start=1)}

    def declare(self, topic: str, schema: str, descriptor_set: bytes) -> list[McapRecord]:
        """Add a channel, and its schema where that is new; the records that say so."""
        records: list[McapRecord] = []
        if (schema, descriptor_set) not in self.schemas:
            self.schemas.append((schema, descriptor_set))
            records.append(self._schema_records()[-1])
        self.channels.append((topic, self.schemas.index((schema, descriptor_set)) + 1))
        self.counts.append(0)
        return [*records, self._channel_records()[-1]]

    def groups(self, chunks: Sequence[ChunkIndex], metadata_n: int) -> list[tuple[Opcode, Sequence[McapRecord]]]:
        """Schemas, channels and statistics as the summary repeats them."""
        filled = [chunk for chunk in chunks if chunk.message_index_offsets]
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self.channels),
            channel_message_counts=dict(enumerate(self.counts, start=1)),
            chunk_count=len(chunks),
            message_count=sum(self.counts),
            metadata_count=metadata_n,
            message_start_time=min((chunk.message_start_time for chunk in filled), default=0),
            message_end_time=max((chunk.message_end_time for chunk in filled), default=0),
            schema_count=len(self.schemas),
        )
        return [
            (Opcode.SCHEMA, self._schema_records()),
            (Opcode.CHANNEL, self._channel_records()),
            (Opcode.STATISTICS, [statistics]),
        ]

    def to_json(self) -> dict[str, Any]:
        """Plain values of which ``from_json`` makes the same again."""
        schemas = [(name, data.hex()) for name, data in self.schemas]
        return {"schemas": schemas, "channels": self.channels, "counts": self.counts}

    @classmethod
    def from_json(cls, plain: Mapping[str, Any]) -> Declarations:
        """Return what ``to_json`` gave."""
        schemas = [(name, bytes.fromhex(data)) for name, data in plain["schemas"]]
        return cls(schemas, [(topic, schema) for topic, schema in plain["channels"]], list(plain["counts"]))

    def _schema_records(self) -> list[Schema]:
        return [
            Schema(id=number, name=name, encoding=ENCODING, data=data)
            for number, (name, data) in enumerate(self.schemas, start=1)
        ]

    def _channel_records(self) -> list[Channel]:
        return [
            Channel(id=number, topic=topic, message_encoding=ENCODING, metadata={}, schema_id=schema)
            for number, (topic, schema) in enumerate(self.channels, start=1)
        ]


def summary_and_footer(
    start: int, declared: Declarations, chunks: Sequence[ChunkIndex], metadata: Sequence[MetadataIndex]
) -> bytes:
    """Return all that follows the data section, which ends at byte ``start`` of the file."""
    groups = [
        *declared.groups(chunks, len(metadata)),
        (Opcode.CHUNK_INDEX, chunks),
        (Opcode.METADATA_INDEX, metadata),
    ]
    summary, offsets = b"", []
    for opcode, records in groups:
        data = record_bytes(records)
        if data:
            offsets.append(SummaryOffset(group_opcode=opcode, group_start=start + len(summary), group_length=len(data)))
        summary += data
    offset_start = start + len(summary)
    summary += record_bytes(offsets)
    covered = _FOOTER.pack(Opcode.FOOTER, _FOOTER_BYTES, start, offset_start)
    crc = zlib.crc32(covered, zlib.crc32(summary))
    footer = Footer(summary_start=start, summary_offset_start=offset_start, summary_crc=crc)
    return summary + record_bytes([footer]) + MAGIC
