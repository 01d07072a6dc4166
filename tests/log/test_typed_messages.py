"""Typed reading: what was logged comes back as the declared dataclass, or one line says why it cannot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kendama_cli.errors import InputError
from kendama_cli.log.reader import LogFile
from kendama_cli.log.writer import McapLog
from kendama_cli.report.source import StageLog
from kendama_cli.schema.foxglove import FrameTransform
from kendama_cli.stages.adapt.messages import AdaptRepeatMessage, AdaptWindowMessage
from kendama_cli.stages.learn.messages import QTableMessage
from tests.log.made_logs import MemoryFile


def written(path: Path, topics: Mapping[str, type], messages: list[tuple[str, float, object]]) -> Path:
    log = McapLog(topics, MemoryFile())
    for topic, t_s, message in messages:
        log.write(topic, t_s, message)
    log.finish(path, stage="x", settings={}, metrics={})
    return path


def test_messages_come_back_typed_and_in_order_of_time(log_file: Path) -> None:
    repeats = LogFile(log_file).messages("/adapt/repeat", AdaptRepeatMessage)
    assert len(repeats) == 300
    assert repeats.column(lambda repeat: repeat.index).tolist() == list(range(300))
    assert repeats.messages[3].caught is True
    assert repeats.t_s[-1] == 2.99
    (table,) = LogFile(log_file).messages("/learn/table", QTableMessage).messages
    assert table == QTableMessage(0, 2, 2, (0.0, 1.0, 2.0, 3.0))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 10**6), st.integers(-(2**63), 2**63 - 1), st.booleans(), st.floats())))
def test_any_log_reads_back_as_written(tmp_path_factory: pytest.TempPathFactory, rows: list[tuple]) -> None:  # type: ignore[type-arg]
    logged = [("/r", 1e-3 * t_ms, AdaptRepeatMessage(index, caught, miss)) for t_ms, index, caught, miss in rows]
    path = written(tmp_path_factory.mktemp("log") / "log.mcap", {"/r": AdaptRepeatMessage}, list(logged))
    if not rows:
        assert LogFile(path).topics == ()
        return
    read = LogFile(path).messages("/r", AdaptRepeatMessage)
    ordered = sorted(logged, key=lambda one: round(1e9 * one[1]))
    assert repr(read.messages) == repr(tuple(message for *_, message in ordered))


@dataclass(frozen=True)
class Renamed:
    """AdaptRepeat as an older version might have had it."""

    index: int
    caught: bool
    error_m: float


def test_a_log_of_another_version_is_refused_with_its_fields(tmp_path: Path) -> None:
    older = type("AdaptRepeatMessage", (Renamed,), {"__module__": "kendama_cli.older"})
    path = written(tmp_path / "old.mcap", {"/r": older}, [("/r", 0.0, older(1, True, 0.0))])
    says = (
        "the fields of kendama.AdaptRepeat on topic '/r' are not those of AdaptRepeatMessage but index, caught, error_m"
    )
    for read in (LogFile(path).messages, LogFile(path).table, StageLog(path).table):
        with pytest.raises(InputError, match=says) as caught:
            read("/r", AdaptRepeatMessage)
        assert "\n" not in str(caught.value)


def test_another_message_than_asked_for_is_named(log_file: Path) -> None:
    with pytest.raises(InputError, match=r"topic '/adapt/cup' holds foxglove.FrameTransform, not kendama.AdaptRepeat"):
        StageLog(log_file).messages("/adapt/cup", AdaptRepeatMessage)


def test_a_topic_that_is_not_there_is_an_empty_table_with_its_columns(log_file: Path) -> None:
    log = StageLog(log_file)
    assert list(log.table("/adapt/window", AdaptWindowMessage).columns) == [
        "t_s",
        "index",
        "low",
        "high",
        "middle",
        "swing_slack_s",
    ]
    assert list(log.table("/adapt/none", FrameTransform).columns) == list(
        log.table("/adapt/cup", FrameTransform).columns
    )
    assert len(log.messages("/adapt/window", AdaptWindowMessage)) == 0
