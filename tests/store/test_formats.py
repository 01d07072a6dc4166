"""Results of another format are refused in one line that names both, and neither misread nor deleted."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kendama_cli.errors import FormatError, InputError, KendamaError
from kendama_cli.log import container_writer
from kendama_cli.log.reader import LogFile
from kendama_cli.log.writer import McapLog
from kendama_cli.motion.dmp.plan_text import plan_from_text
from kendama_cli.pipeline.record import past_runs, version_differences, versions
from kendama_cli.store import checkpoint, durable, store
from kendama_cli.store.checkpoint import CheckpointFolder, DurableAppendFile
from kendama_cli.store.garbage import collect_garbage, verify
from kendama_cli.store.home import record_path
from kendama_cli.store.store import Store

KEY = "a" * 40


def filled(home: Path) -> Store:
    made = Store(home)
    with made.scratch_folder() as folder:
        (folder / "artifact.json").write_text("{}")
        made.put(folder, "roll", KEY, {"n": 1}, {}, made_with={"numpy": "0.1"})
    record = {"run": "00001-abcdef", "outcome": "done", "stages": [{"name": "roll", "key": KEY}]}
    durable.write_sealed(home / "runs/00001-abcdef.json", record)
    CheckpointFolder(home / "checkpoints/roll" / ("b" * 40)).save({"x": np.zeros(2)}, {}, nothing_logged())
    return made


def nothing_logged() -> bytes:
    return container_writer.ContainerWriter(DurableAppendFile(Path("never-written"))).position()


def files(home: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in home.rglob("*") if path.is_file() and path.parent.name != "locks"}


@pytest.mark.parametrize(
    ("module", "read"),
    [
        (durable, lambda made: made.find("roll", KEY)),
        (durable, lambda made: past_runs(made.home)),
        (store, lambda made: made.find("roll", KEY)),
        (checkpoint, lambda made: list(CheckpointFolder(made.home / "checkpoints/roll" / ("b" * 40)).intact())),
        *((module, one) for module in (durable, store) for one in (verify, collect_garbage)),
        (checkpoint, verify),
    ],
)
def test_a_home_of_another_format_is_refused_and_left_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: Any, read: Any
) -> None:
    with monkeypatch.context() as newer:
        newer.setattr(module, "FORMAT", 7)
        if module is durable:
            newer.setattr(durable._sealed, "__defaults__", (7,))
        made = filled(tmp_path)
    before = files(tmp_path)
    with pytest.raises(FormatError, match="of format 7, and this version of kendama reads format 1") as caught:
        read(made)
    assert caught.value.exit_code == 2
    assert len(str(caught.value).splitlines()) == 1
    assert files(tmp_path) == before


def test_a_record_without_a_number_is_of_the_first_edition_and_refused(tmp_path: Path) -> None:
    body = json.dumps({"outcome": "done"})
    seal = durable.sha256(body.encode())
    (tmp_path / "run.json").write_text(f'{{"record": {body}, "seal": "{seal}"}}\n')
    with pytest.raises(FormatError, match="of format 0"):
        durable.read_sealed(tmp_path / "run.json")


@pytest.mark.parametrize("old", [b'"format": 1', b'"record"', b'"seal"'])
def test_a_damaged_number_is_damage_and_no_other_format(tmp_path: Path, old: bytes) -> None:
    made = filled(tmp_path)
    path = made.result_path("roll", KEY)
    whole = path.read_bytes()
    assert whole.count(old) == 1
    place = whole.index(old)
    for i in range(len(old)):
        for bit in range(8):
            path.write_bytes(whole[: place + i] + bytes([old[i] ^ (1 << bit)]) + whole[place + i + 1 :])
            assert made.find("roll", KEY) is None


def log(path: Path) -> Path:
    written = McapLog({}, DurableAppendFile(path.with_suffix(".part")))
    written.finish(path, stage="roll", settings={}, metrics={})
    return path


def test_a_log_of_another_format_is_refused_and_a_foreign_one_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert LogFile(log(tmp_path / "own.mcap")).stage["stage"] == "roll"
    with monkeypatch.context() as newer:
        newer.setattr(container_writer, "FORMAT", 12)
        other = log(tmp_path / "newer.mcap")
        newer.setattr(container_writer, "LIBRARY", "somebody")
        foreign = log(tmp_path / "foreign.mcap")
    with pytest.raises(FormatError, match=r"newer\.mcap: a log of format 12, .* reads format 1"):
        LogFile(other)
    assert LogFile(foreign).topics == ()


def test_a_primitive_of_another_format_is_refused() -> None:
    with pytest.raises(ValueError, match="'format' is 'kendama motion 2', not 'kendama motion 1'"):
        plan_from_text("format: kendama motion 2\n", "yaml")


def test_a_result_says_which_library_it_was_made_with_in_another_version(tmp_path: Path) -> None:
    found = filled(tmp_path).find("roll", KEY)
    assert found is not None
    differences = version_differences(found.made_with)
    assert f"numpy 0.1, here {versions()['numpy']}" in differences
    assert version_differences(versions()) == []
    assert version_differences({}) == []


def test_a_checkpoint_that_was_cut_anywhere_is_passed_over(tmp_path: Path) -> None:
    folder = CheckpointFolder(tmp_path / "roll")
    folder.save({"x": np.arange(3)}, {}, b"log")
    (path,) = folder.files()
    whole = path.read_bytes()
    for size in range(len(whole)):
        path.write_bytes(whole[:size])
        assert list(folder.intact()) == []
    path.write_bytes(whole)
    (found,) = folder.intact()
    assert found.log == b"log"
    assert struct.calcsize("<IQ") == 12


def test_what_is_saved_after_damaged_checkpoints_is_the_newest(tmp_path: Path) -> None:
    first = CheckpointFolder(tmp_path / "roll")
    for number in range(4):
        first.save({"n": number}, {}, b"")
    for path in first.files():
        path.write_bytes(b"torn")
    second = CheckpointFolder(tmp_path / "roll")
    assert list(second.intact()) == []
    second.save({"n": 99}, {}, b"")
    assert [found.state["n"] for found in CheckpointFolder(tmp_path / "roll").intact()] == [99]


def test_a_checkpoint_that_cannot_be_deleted_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = CheckpointFolder(tmp_path / "roll")
    for number in range(2):
        folder.save({"n": number}, {}, b"")

    def refuse(path: Path, **_: Any) -> None:
        raise OSError(5, "Input/output error", str(path))

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", refuse)
        with pytest.raises(KendamaError, match="Input/output error"):
            folder.save({"n": 2}, {}, b"")
    assert next(found.state["n"] for found in folder.intact()) == 2


def test_verify_reads_checkpoints_and_the_log_that_they_count_on(tmp_path: Path) -> None:
    made = filled(tmp_path)
    assert verify(made) == []
    folder = CheckpointFolder(tmp_path / "checkpoints/roll" / ("b" * 40))
    file = DurableAppendFile(folder.log_path)
    writer = container_writer.ContainerWriter(file)
    channel = writer.add_channel("/a", "b", b"")
    for number in range(3):
        writer.add(channel, number, bytes(container_writer.CHUNK_BYTES))
    file.sync()
    folder.save({"n": 1}, {}, writer.position())
    assert verify(made) == []
    for path, problem in ((folder.files()[-1], "the checkpoint's bytes"), (folder.log_path, "the log that")):
        whole = path.read_bytes()
        path.write_bytes(whole[:-9] + bytes([whole[-9] ^ 1]) + whole[-8:])
        (damage,) = verify(made)
        assert damage.path == path
        assert damage.problem.startswith(problem)
        path.write_bytes(whole)


def test_a_log_that_is_none_is_no_log_of_another_format(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"kendama log 9")
    with pytest.raises(InputError, match="not an MCAP file"):
        LogFile(tmp_path / "a.mcap")


def test_a_record_where_kendama_stored_it_until_0_2_is_refused_with_both_places_named(tmp_path: Path) -> None:
    store = filled(tmp_path)
    before = tmp_path / "runs/00001-abcdef/run.json"
    before.parent.mkdir()
    record_path(tmp_path, "00001-abcdef").rename(before)
    for reads in (lambda: past_runs(tmp_path), lambda: verify(store), lambda: collect_garbage(store)):
        with pytest.raises(FormatError, match=r"run\.json: .*runs/RUN/run\.json.*reads format runs/RUN\.json"):
            reads()
    assert before.exists()
    before.rename(record_path(tmp_path, "00001-abcdef"))
    assert [record["run"] for record in past_runs(tmp_path)] == ["00001-abcdef"]
