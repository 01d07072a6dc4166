"""A log of an older version by the names of today: topics, schemas, fields, settings and metrics; messages stay."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import pytest

from kendama_cli.errors import InputError
from kendama_cli.log.reader import LogFile
from kendama_cli.log.writer import McapLog, MemoryFile
from kendama_cli.plugins.migration.home import migrate_log
from kendama_cli.report.source import StageLog
from kendama_cli.stages.adapt.messages import AdaptPerturbationMessage, AdaptRepeatMessage

FIELDS = [field.name for field in dataclasses.fields(AdaptPerturbationMessage)]
DRAWN = dataclasses.make_dataclass(
    "AdaptDrawMessage",
    [
        (one.name.replace("fraction", "share"), {"int": int}.get(str(one.type), float))
        for one in dataclasses.fields(AdaptPerturbationMessage)
    ],
    frozen=True,
)
DRAWN.__module__ = "kendama_cli.stages.adapt.messages"


@dataclass(frozen=True)
class _Repeat:
    index: int
    caught: bool
    miss_m: float
    shift_m: float = 0.0
    largest_shift_m: float = 0.0


REPEAT = type("AdaptRepeatMessage", (_Repeat,), {"__module__": "kendama_cli.stages.adapt.messages"})
REPEAT = dataclass(frozen=True)(REPEAT)
VALUES = [float(number) for number in range(1, len(FIELDS))]


@pytest.fixture
def old(tmp_path) -> Path:
    log = McapLog({"/adapt/drawn": DRAWN, "/adapt/repeat": REPEAT}, MemoryFile())
    for index in range(3):
        log.write("/adapt/drawn", 0.5 * index, DRAWN(index, *VALUES))
        log.write("/adapt/repeat", 0.5 * index, REPEAT(index, True, 0.01, 0.02, 0.03))
    settings = {"adapt": {"catch": "open", "eyes": {"rate_hz": 60.0}}}
    metrics = {"in_the_way": "nothing", "shift_mm": 3.0, "catch": "open", "caught": True}
    log.finish(tmp_path / "old.mcap", stage="adapt", settings=settings, metrics=metrics)
    return tmp_path / "old.mcap"


def test_messages_are_read_under_their_topics_and_fields_of_today(old, tmp_path):
    assert migrate_log(old, tmp_path / "new.mcap")
    log = LogFile(tmp_path / "new.mcap")
    assert log.topics == ("/adapt/perturbation", "/adapt/repeat")
    read = log.messages("/adapt/perturbation", AdaptPerturbationMessage)
    assert read.t_s.tolist() == [0.0, 0.5, 1.0]
    assert read.messages == tuple(AdaptPerturbationMessage(index, *VALUES) for index in range(3))
    (repeat, *_) = log.messages("/adapt/repeat", AdaptRepeatMessage).messages
    assert repeat == AdaptRepeatMessage(0, True, 0.01, 0.02, 0.03)


def test_settings_and_metrics_have_their_names_and_values_of_today(old, tmp_path):
    migrate_log(old, tmp_path / "new.mcap")
    facts = LogFile(tmp_path / "new.mcap").stage
    assert facts["settings"] == {"adapt": {"catch": "open_loop", "sensor_model": {"rate_hz": 60.0}}}
    assert facts["metrics"] == {"failure_reason": "nothing", "goal_shift_mm": 3.0, "catch": "open_loop", "caught": True}


def test_a_log_of_today_is_left(old, tmp_path):
    migrate_log(old, tmp_path / "new.mcap")
    assert not migrate_log(tmp_path / "new.mcap", tmp_path / "again.mcap")
    assert not (tmp_path / "again.mcap").exists()


def test_a_rewritten_log_has_the_bytes_of_one_that_was_written_today(old, tmp_path):
    migrate_log(old, tmp_path / "new.mcap")
    topics = {"/adapt/perturbation": AdaptPerturbationMessage, "/adapt/repeat": AdaptRepeatMessage}
    log = McapLog(topics, MemoryFile())
    for index in range(3):
        log.write("/adapt/perturbation", 0.5 * index, AdaptPerturbationMessage(index, *VALUES))
        log.write("/adapt/repeat", 0.5 * index, AdaptRepeatMessage(index, True, 0.01, 0.02, 0.03))
    facts = LogFile(tmp_path / "new.mcap").stage
    log.finish(tmp_path / "today.mcap", stage="adapt", settings=facts["settings"], metrics=facts["metrics"])
    assert (tmp_path / "new.mcap").read_bytes() == (tmp_path / "today.mcap").read_bytes()


def test_a_report_of_an_old_log_is_refused_with_the_command_that_rewrites_it(old):
    log = StageLog(old)
    with pytest.raises(
        InputError, match=r"its topic '/adapt/drawn' is '/adapt/perturbation' since 0\.3; type 'kendama c"
    ):
        log.table("/adapt/perturbation", AdaptPerturbationMessage)
    with pytest.raises(InputError, match=r"largest_shift_m; it was logged by another version: type 'kendama cache mig"):
        log.messages("/adapt/repeat", AdaptRepeatMessage)
