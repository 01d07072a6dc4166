"""The log writer: deterministic files, segments that carry a log over a kill, no trace of the machine."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from kendama_cli.log.reader import LogFile
from kendama_cli.log.writer import McapLog, canonical_json
from kendama_cli.schema.messages import LogSchemaError
from tests.log.conftest import filled

FACTS = {"stage": "adapt", "settings": {"a": {"b": 1.5}}, "metrics": {"caught": True}}


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


@pytest.mark.parametrize("cuts", [(1,), (250, 250, 251), (0, 900)])
def test_a_log_restored_from_its_segments_ends_in_the_same_bytes(tmp_path, cuts):
    whole = filled()
    messages = whole._messages
    log, segments, start = McapLog(), [], 0
    for cut in cuts:  # write up to the checkpoint, save the segment, be killed, restore all segments
        log._messages += messages[start:cut]
        start = max(start, cut)
        segments.append(log.segment())
        log = McapLog()
        for segment in segments:
            log.load_segment(segment)
    log._messages += messages[start:]
    log.finish(tmp_path / "resumed.mcap", **FACTS)
    whole.finish(tmp_path / "whole.mcap", **FACTS)
    assert (tmp_path / "resumed.mcap").read_bytes() == (tmp_path / "whole.mcap").read_bytes()


def test_the_reference_reader_finds_its_way_by_summary_and_index(log_file):
    with log_file.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary.statistics.message_count == 901
        assert {channel.topic for channel in summary.channels.values()} == set(LogFile(log_file).topics)
        assert [item.name for item in reader.iter_metadata()] == ["kendama.stage"]
        assert reader.get_header().library == "kendama"
        times = [message.log_time for _, _, message in reader.iter_messages("/adapt/cup", starting_at=10**9)]
        assert times == [10_000_000 * step for step in range(100, 300)]


def test_a_segment_holds_only_what_came_since_the_last():
    log = filled()
    first = log.segment()
    log.write("/adapt/repeat", 9.0, {"index": 1, "caught": True, "miss_m": 0.0})
    second = log.segment()
    restored = McapLog()
    restored.load_segment(first)
    assert len(restored) == len(log) - 1
    restored.load_segment(second)
    assert restored._messages == log._messages
    assert len(second) < 200 < len(first)


def test_every_damaged_byte_of_a_segment_is_found_and_nothing_is_restored():
    log = filled(2)
    segment = log.segment()
    for at in range(len(segment)):
        broken = bytearray(segment)
        broken[at] ^= 1
        restored = McapLog()
        with pytest.raises(ValueError, match="is damaged: its digest does not match"):
            restored.load_segment(bytes(broken))
        assert len(restored) == 0
    with pytest.raises(ValueError, match="is damaged"):
        McapLog().load_segment(segment[:-1])


def test_messages_come_out_in_order_of_time_and_equal_times_in_order_of_writing(tmp_path):
    log = McapLog()
    for index, t_s in enumerate([2.0, 1.0, 1.0, 0.5]):
        log.write("/adapt/repeat", t_s, {"index": index, "caught": False, "miss_m": 0.0})
    log.finish(tmp_path / "log.mcap", **FACTS)
    table = LogFile(tmp_path / "log.mcap").table("/adapt/repeat")
    assert table["index"].tolist() == [3, 1, 2, 0]
    assert table["t_s"].tolist() == [0.5, 1.0, 1.0, 2.0]


@pytest.mark.parametrize("t_s", [-0.001, math.nan, math.inf])
def test_a_time_that_is_negative_or_not_finite_is_refused(t_s):
    with pytest.raises(LogSchemaError, match="topic '/adapt/repeat': time must be finite and not negative"):
        McapLog().write("/adapt/repeat", t_s, {"index": 0, "caught": True, "miss_m": 0.0})


def test_a_wrong_field_names_topic_and_field():
    with pytest.raises(LogSchemaError, match=r"topic '/adapt/repeat': kendama.AdaptRepeat: unknown field 'miss'"):
        McapLog().write("/adapt/repeat", 0.0, {"index": 0, "caught": True, "miss_m": 0.0, "miss": 0.0})


def test_no_folder_of_this_machine_enters_the_file(tmp_path):
    settings = {"capture": {"path": ("/home/someone/swing.csv",), "rate_hz": np.float64(100.0)}}
    McapLog().finish(tmp_path / "log.mcap", stage="capture", settings=settings, metrics={"rmse_mm": math.nan})
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
