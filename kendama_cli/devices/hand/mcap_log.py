"""Reading recordings from MCAP: transforms of the cup, as an earlier capture or another program logged them."""

from __future__ import annotations

import io
import struct
import zlib
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from google.protobuf.message import DecodeError
from mcap.exceptions import McapError
from mcap.records import Channel, Footer, Message, Schema
from mcap.stream_reader import CRCValidationError, StreamReader
from zstandard import ZstdError

from kendama_cli.devices.hand.recording import Recording
from kendama_cli.devices.hand.settings import FileCapture
from kendama_cli.errors import InputError

MAGIC = b"\x89MCAP0\r\n"
SCHEMA = "foxglove.FrameTransform"
USUAL_TOPIC = "/capture/cup"
_FOOTER_BYTES = 1 + 8 + 20
_REMEDY = "copy or record it again ('mcap recover' saves what is whole)"


@dataclass
class _Track:
    """The samples of one child frame, and how many messages of the topic came before each."""

    t_ns: list[int] = field(default_factory=list)
    position_m: list[tuple[float, float, float]] = field(default_factory=list)
    message: list[int] = field(default_factory=list)


def read_mcap(path: str, content: bytes, settings: FileCapture) -> list[Recording]:
    """The recordings in the MCAP file ``path``, one per child frame of the topic.

    Raises InputError for a file that is cut short or damaged (every CRC is checked), and for one without the topic.
    """
    channels, messages = _records(path, content)
    topic = _topic(path, channels, messages, settings.topic)
    tracks: dict[str, _Track] = {}
    for number, message in enumerate((m for m in messages if channels[m.channel_id][0] == topic), start=1):
        try:
            transform = FrameTransform.FromString(message.data)
        except DecodeError:
            problem = f"a message that is no {SCHEMA}"
            raise InputError(path, problem, where=f"message {number} of {topic}", remedy=_REMEDY) from None
        track = tracks.setdefault(transform.child_frame_id, _Track())
        stamp = transform.timestamp
        # a producer that leaves the time stamp out means the time of the log
        track.t_ns.append(stamp.ToNanoseconds() if transform.HasField("timestamp") else message.log_time)
        at = transform.translation
        track.position_m.append((at.x, at.y, at.z))
        track.message.append(number)
    if settings.child is not None:
        if settings.child not in tracks:
            listed = ", ".join(f"'{child}'" for child in tracks)
            problem = f"no child frame '{settings.child}' on {topic}; it has {listed}"
            raise InputError(path, problem, remedy="set capture.child to one of them")
        tracks = {settings.child: tracks[settings.child]}
    return [_recording(path, topic, child, track) for child, track in tracks.items()]


def _recording(path: str, topic: str, child: str, track: _Track) -> Recording:
    t_ns = np.array(track.t_ns, dtype=np.int64)
    numbers = list(track.message)
    return Recording(
        path,
        child or Path(path).stem,
        (t_ns - t_ns[0]) * 1e-9,
        np.array(track.position_m),
        lambda sample: f"message {numbers[sample]} of {topic}",
        f"look at capture.topic and have {SCHEMA} written in metres, as it is defined",
    )


def _records(path: str, content: bytes) -> tuple[dict[int, tuple[str, str]], list[Message]]:
    """Channels by id as (topic, schema name), and all messages."""
    if not content.startswith(MAGIC):
        raise InputError(path, "not an MCAP file (it does not begin with MCAP's magic)", remedy="name an MCAP file")
    stream = io.BytesIO(content)
    schemas: dict[int, str] = {}
    channels: dict[int, tuple[str, str]] = {}
    messages: list[Message] = []
    try:
        for record in StreamReader(stream, validate_crcs=True, record_size_limit=len(content)).records:
            if isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                channels[record.id] = (record.topic, schemas.get(record.schema_id, ""))
            elif isinstance(record, Message):
                messages.append(record)
            elif isinstance(record, Footer):
                _check_summary(content, record)
    except (McapError, CRCValidationError, ZstdError, struct.error, ValueError, MemoryError, KeyError) as wrong:
        short = not content.endswith(MAGIC)  # a whole file ends with its magic again
        what = f"is cut short after {len(content)} bytes" if short else f"is damaged ({wrong or type(wrong).__name__})"
        where = "" if short else f"before byte {stream.tell()}"
        raise InputError(path, f"the MCAP file {what}", where=where, remedy=_REMEDY) from None
    undeclared = {message.channel_id for message in messages} - channels.keys()
    if undeclared:
        raise InputError(path, f"the MCAP file is damaged (channel {min(undeclared)} is not declared)", remedy=_REMEDY)
    return channels, messages


def _check_summary(content: bytes, footer: Footer) -> None:
    """Hold the summary against its CRC, which the library's stream reader does not check."""
    end = len(content) - len(MAGIC) - 4
    start = footer.summary_start or end + 4 - _FOOTER_BYTES
    if footer.summary_crc and zlib.crc32(content[start:end]) != footer.summary_crc:
        raise ValueError("the CRC of the summary does not match")


def _topic(path: str, channels: dict[int, tuple[str, str]], messages: list[Message], wanted: str | None) -> str:
    filled = Counter(channels[message.channel_id] for message in messages)
    fitting = sorted({topic for topic, schema in filled if schema == SCHEMA})
    if wanted is None and len(fitting) == 1:
        return fitting[0]
    choice = wanted or USUAL_TOPIC
    if choice in fitting:
        return choice
    listed = ", ".join(f"{topic} ({schema}, {count})" for (topic, schema), count in sorted(filled.items()))
    problem = f"no messages of {SCHEMA} on the topic '{choice}'; it has {listed or 'no messages'}"
    raise InputError(path, problem, remedy="set capture.topic to a topic with the cup's transforms")
