"""The log writer: deterministic files, going on after a kill, no trace of the machine, nothing undeclared."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from kendama_cli.errors import LogMessageError, StageError
from kendama_cli.log.reader import LogFile
from kendama_cli.log.writer import McapLog, canonical_json
from kendama_cli.stages.adapt.messages import AdaptRepeatMessage
from tests.log.conftest import filled, messages
from tests.log.made_logs import MemoryFile, all_topics, memory_log

FACTS = {"stage": "adapt", "settings": {"a": {"b": 1.5}}, "metrics": {"caught": True}}
LONG = 10_000
"""Instants of ``messages`` that fill several chunks."""
REPEAT = AdaptRepeatMessage(index=0, caught=True, miss_m=0.0)


def test_another_process_writes_the_same_bytes(tmp_path, log_file):
    program = (
        "import sys; from tests.log.conftest import filled;"
        "filled().finish(sys.argv[1], stage='adapt', settings={'a': {'b': 1.5}}, metrics={'caught': True})"
    )
    other = tmp_path / "elsewhere" / "other.mcap"
    other.parent.mkdir()
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", program, str(other)], check=True, cwd=root, env={"PYTHONHASHSEED": "7"})
    assert other.read_bytes() == log_file.read_bytes()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "log.mcap"
    filled(LONG).finish(path, **FACTS)
    return path.read_bytes()


@pytest.mark.parametrize("cuts", [(1,), (250, 250, 9_000), (0, 17_000, 30_001)])
@pytest.mark.parametrize("lost", [0, 400])
def test_a_log_that_is_killed_and_restored_ends_in_the_same_bytes(tmp_path, whole, cuts, lost):
    """Up to each checkpoint, ``lost`` messages beyond it, killed, restored from it."""
    every = list(messages(LONG))
    file, position, start = MemoryFile(), b"", 0
    for cut in cuts:
        log = McapLog(all_topics(), file)
        if position:
            log.restore(position)
        for topic, t_s, message in every[start:cut]:
            log.write(topic, t_s, message)
        position, start = log.position(), cut
        for topic, t_s, message in every[cut : cut + lost]:
            log.write(topic, t_s, message)
    log = McapLog(all_topics(), file)
    log.restore(position)
    assert len(log) == cuts[-1]
    for topic, t_s, message in every[start:]:
        log.write(topic, t_s, message)
    log.finish(tmp_path / "resumed.mcap", **FACTS)
    assert (tmp_path / "resumed.mcap").read_bytes() == whole


def test_a_file_that_lost_what_a_position_counts_on_is_refused_and_nothing_changes():
    log = filled(LONG)
    file, position = log._container._file, log.position()
    for spoil in (lambda: file.cut(1000), lambda: file.content.__setitem__(500, file.content[500] ^ 1)):
        kept = bytes(file.content)
        spoil()
        again = McapLog(all_topics(), file)
        with pytest.raises(ValueError, match=r"the first \d+ bytes of the log are not those that were written"):
            again.restore(position)
        assert len(again) == 0
        file.content[:] = kept


def test_the_memory_that_a_log_takes_does_not_grow_with_it(tmp_path):
    """200 MB of messages that hardly compress; the bound is half of what they would take in memory."""
    program = Path(__file__).with_name("stream_much.py")
    done = subprocess.run(
        [sys.executable, str(program), str(tmp_path)],
        check=True,
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
    )
    logged_mb, grown_mb = (float(number) for number in done.stdout.split())
    assert logged_mb >= 200
    assert grown_mb < 100


def test_the_reference_reader_finds_messages_by_summary_and_index(log_file):
    with log_file.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary.statistics.message_count == 901
        assert {channel.topic for channel in summary.channels.values()} == set(LogFile(log_file).topics)
        assert [item.name for item in reader.iter_metadata()] == ["kendama.stage"]
        assert reader.get_header().library == "kendama log 1", "the format's number stands in the header"
        times = [message.log_time for _, _, message in reader.iter_messages("/adapt/cup", starting_at=10**9)]
        assert times == [10_000_000 * step for step in range(100, 300)]


def test_the_reference_reader_merges_chunks_in_order_of_time(tmp_path, whole):
    (tmp_path / "log.mcap").write_bytes(whole)
    with (tmp_path / "log.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        statistics = reader.get_summary().statistics
        assert statistics.chunk_count > 2
        assert (statistics.message_start_time, statistics.message_end_time) == (0, (LONG - 1) * 10_000_000)
        assert statistics.channel_message_counts == {
            1: LONG,
            2: LONG,
            3: LONG,
            4: 1,
        }
        times = [message.log_time for _, _, message in reader.iter_messages()]
        assert len(times) == 3 * LONG + 1
        assert times == sorted(times)


def test_a_table_is_in_order_of_time_and_equal_times_in_order_of_writing(tmp_path):
    log = memory_log()
    for index, t_s in enumerate([2.0, 1.0, 1.0, 0.5]):
        log.write("/adapt/repeat", t_s, AdaptRepeatMessage(index=index, caught=False, miss_m=0.0))
    log.finish(tmp_path / "log.mcap", **FACTS)
    table = LogFile(tmp_path / "log.mcap").table("/adapt/repeat")
    assert table["index"].tolist() == [3, 1, 2, 0]
    assert table["t_s"].tolist() == [0.5, 1.0, 1.0, 2.0]


@pytest.mark.parametrize("t_s", [-0.001, math.nan, math.inf])
def test_a_time_that_is_negative_or_not_finite_is_refused(t_s):
    with pytest.raises(LogMessageError, match="topic '/adapt/repeat': time must be finite and not negative"):
        memory_log().write("/adapt/repeat", t_s, REPEAT)


@dataclass(frozen=True)
class Lookalike:
    """The fields of another message."""

    index: int
    caught: bool
    miss_m: float


@pytest.mark.parametrize(
    ("topic", "message", "says"),
    [
        (
            "/adapt/repeats",
            REPEAT,
            r"the stage logs to topic '/adapt/repeats', which it does not declare; it ",
        ),
        (
            "/adapt/repeat",
            {"index": 0},
            r"topic '/adapt/repeat' is declared to hold AdaptRepeatMessage, but a dict",
        ),
        (
            "/adapt/repeat",
            Lookalike(0, True, 0.0),
            r"to hold AdaptRepeatMessage, but a Lookalike was",
        ),
        (
            "/adapt/repeat",
            AdaptRepeatMessage(0, True, None),
            r"'/adapt/repeat': a field of AdaptRepeatMessage has",
        ),
    ],
)
def test_what_is_not_declared_fails_the_stage_in_one_line(topic, message, says):
    with pytest.raises(StageError, match=says) as caught:
        memory_log().write(topic, 0.0, message)
    assert "\n" not in str(caught.value)
    assert caught.value.topic == topic


def test_no_folder_of_this_machine_enters_the_file(tmp_path):
    settings = {"capture": {"path": ("/home/someone/swing.csv",), "rate_hz": np.float64(100.0)}}
    memory_log().finish(tmp_path / "log.mcap", stage="capture", settings=settings, metrics={"rmse_mm": math.nan})
    stage = LogFile(tmp_path / "log.mcap").stage
    assert stage == {
        "stage": "capture",
        "settings": {"capture": {"path": ["swing.csv"], "rate_hz": 100.0}},
        "metrics": {"rmse_mm": None},
    }
    assert b"someone" not in (tmp_path / "log.mcap").read_bytes()


def test_canonical_json_does_not_depend_on_the_order_of_keys():
    assert (
        canonical_json({"b": 1, "a": [1.5, None]})
        == canonical_json({"a": (1.5, None), "b": 1})
        == '{"a":[1.5,null],"b":1}'
    )
