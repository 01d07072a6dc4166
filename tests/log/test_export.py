"""Exports: one table per file with the topic in front, one file per topic in a folder, errors in one line."""

import sys

import numpy as np
import pandas as pd
import pytest

from kendama_cli.errors import InputError, MissingPartError, StoreError, UsageError
from kendama_cli.log.export import export
from kendama_cli.log.reader import LogFile
from kendama_cli.schema.foxglove import CompressedImage
from tests.log.made_logs import memory_log


def test_a_parquet_file_holds_every_message_under_its_topic(tmp_path, log_file):
    assert export(log_file, tmp_path / "out.parquet") == [tmp_path / "out.parquet"]
    table = pd.read_parquet(tmp_path / "out.parquet")
    assert list(table.columns[:2]) == ["topic", "t_s"]
    log = LogFile(log_file)
    for topic in log.topics:
        wanted = log.table(topic)
        part = table[table["topic"] == topic][wanted.columns]
        for column in wanted.columns:
            assert [*map(_plain, part[column])] == [*map(_plain, wanted[column])]


def _plain(value):
    return list(value) if isinstance(value, list | np.ndarray) else value


def test_one_topic_has_only_its_own_fields_and_the_same_values_in_both_formats(tmp_path, log_file):
    export(log_file, tmp_path / "cup.parquet", "/adapt/cup")
    export(log_file, tmp_path / "cup.csv", "/adapt/cup")
    parquet, csv = pd.read_parquet(tmp_path / "cup.parquet"), pd.read_csv(tmp_path / "cup.csv")
    assert list(parquet.columns) == ["topic", *LogFile(log_file).table("/adapt/cup").columns]
    pd.testing.assert_frame_equal(parquet, csv, check_dtype=False, check_exact=True)


def test_lists_and_bytes_become_text_in_csv(tmp_path, log_file):
    export(log_file, tmp_path / "table.csv", "/learn/table")
    assert pd.read_csv(tmp_path / "table.csv")["values"].tolist() == ["[0.0, 1.0, 2.0, 3.0]"]
    log = memory_log()
    log.write("/predict/image/left", 0.0, CompressedImage("left", "png", b"\x00\x01\x02"))
    log.finish(tmp_path / "image.mcap", stage="predict", settings={}, metrics={})
    export(tmp_path / "image.mcap", tmp_path / "image.csv")
    assert pd.read_csv(tmp_path / "image.csv")["data"].tolist() == ["AAEC"]


def test_a_folder_gets_one_file_per_topic(tmp_path, log_file):
    written = export(log_file, tmp_path / "tables")
    assert [path.name for path in written] == [
        "adapt_cup.parquet",
        "adapt_joints.parquet",
        "adapt_repeat.parquet",
        "learn_table.parquet",
    ]
    assert len(pd.read_parquet(tmp_path / "tables" / "adapt_cup.parquet")) == 300


def test_without_a_name_the_file_lands_in_the_current_folder(tmp_path, log_file, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    export(log_file)
    assert (tmp_path / "here" / "log.csv").exists()


def test_the_same_log_gives_the_same_bytes(tmp_path, log_file):
    for suffix in (".parquet", ".csv"):
        first, second = (export(log_file, tmp_path / f"{name}{suffix}")[0].read_bytes() for name in "ab")
        assert first == second


def test_without_pyarrow_a_log_becomes_csv_and_parquet_says_what_to_install(tmp_path, log_file, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingPartError, match=r"out.parquet': Parquet needs pyarrow; pip install '.\[parquet\]'"):
        export(log_file, tmp_path / "out.parquet")
    rows = sum(len(LogFile(log_file).table(topic)) for topic in LogFile(log_file).topics)
    assert len(export(log_file, tmp_path / "out.csv")[0].read_text().splitlines()) == rows + 1


def test_an_unknown_suffix_an_absent_topic_and_a_full_place_are_reported(tmp_path, log_file):
    with pytest.raises(UsageError, match=r"the suffix '.xlsx' is unknown; use .parquet, .csv, or a folder"):
        export(log_file, tmp_path / "out.xlsx")
    with pytest.raises(InputError, match="it has no topic '/cup'"):
        export(log_file, tmp_path / "out.csv", "/cup")
    with pytest.raises(StoreError, match=r"cannot write '.*out.csv'"):
        export(log_file, tmp_path / "missing" / "out.csv")
    memory_log().finish(tmp_path / "empty.mcap", stage="adapt", settings={}, metrics={})
    with pytest.raises(InputError, match="it has no channel, so there is nothing to export"):
        export(tmp_path / "empty.mcap", tmp_path / "out.csv")
