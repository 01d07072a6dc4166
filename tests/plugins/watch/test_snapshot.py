"""A growing log is read as it was at a checkpoint, whole and without disturbing its writer."""

from __future__ import annotations

from pathlib import Path

import pytest

from kendama_cli.log.reader import LogFile
from kendama_cli.log.writer import McapLog
from kendama_cli.plugins.watch.drawing import write_snapshot
from kendama_cli.store.checkpoint import DurableAppendFile
from tests.log.test_writer import all_topics, messages


@pytest.mark.parametrize("before", [5, 4000], ids=["nothing is in the file yet", "the file has whole chunks"])
def test_it_is_whole_up_to_the_checkpoint_and_reads_only(tmp_path: Path, before: int) -> None:
    part, seen = tmp_path / "log.part", tmp_path / "seen.mcap"
    log = McapLog(all_topics(), DurableAppendFile(part))
    every = list(messages(3 * before))
    cut = len(every) // 3
    for one in every[:cut]:
        log.write(*one)
    position = log.position()
    for one in every[cut:]:
        log.write(*one)
    there = part.read_bytes() if part.exists() else None
    assert (before > 100) == bool(there), "chunks are in the file"
    write_snapshot(part, position, seen, stage="adapt", settings={"rope": {"length_m": 0.4}})
    read = LogFile(seen)
    assert read.describe()["messages"] == cut
    assert read.stage == {"stage": "adapt", "settings": {"rope": {"length_m": 0.4}}, "metrics": {}}
    assert (part.read_bytes() if part.exists() else None) == there
    log.finish(tmp_path / "whole.mcap", stage="adapt", settings={}, metrics={})
    assert LogFile(tmp_path / "whole.mcap").describe()["messages"] == len(every), "its writer noticed nothing"


def test_a_log_that_began_anew_meanwhile_is_refused(tmp_path: Path) -> None:
    part = tmp_path / "log.part"
    log = McapLog(all_topics(), DurableAppendFile(part))
    for one in messages(4000):
        log.write(*one)
    position = log.position()
    part.write_bytes(b"another")
    with pytest.raises(ValueError, match="not those that were written"):
        write_snapshot(part, position, tmp_path / "seen.mcap", stage="adapt", settings={})
