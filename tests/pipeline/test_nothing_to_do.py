"""A run whose results are all there waits for nothing, and writes one record."""

from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from kendama_cli.cli.repeat import next_step
from kendama_cli.pipeline import runner
from kendama_cli.pipeline.plan import StagePlan
from kendama_cli.pipeline.record import begin, past_runs
from kendama_cli.store import durable
from kendama_cli.store.home import MARK, record_path
from kendama_cli.store.store import Store, StoredResult
from tests.toy_project import ToyProject


class Silent:
    """Watches nothing."""

    def __getattr__(self, name: str) -> Any:
        return lambda *given: None


def test_a_chain_of_cached_stages_is_walked_without_waiting_and_recorded_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = ("capture", "encode", "learn")
    declaration = SimpleNamespace(name="any", headline=())
    specs = {
        name: SimpleNamespace(name=name, needs={"before": names[i - 1]} if i else {}, declaration=declaration)
        for i, name in enumerate(names)
    }

    def look_up(spec: Any, inputs: dict[str, str], *, forced: bool) -> StagePlan:
        assert list(inputs.values()) == [f"digest of {needed}" for needed in spec.needs.values()]
        result = StoredResult(spec.name, "k" * 40, tmp_path, f"digest of {spec.name}", {"n": 1}, {}, {})
        return StagePlan(spec, "k" * 40, {}, result, ())

    pipeline = SimpleNamespace(stages=list(specs.values()))
    planner: Any = SimpleNamespace(
        pipeline=pipeline, store=Store(tmp_path), look_up=look_up, remember=lambda plan: None
    )
    written: list[Path] = []
    write = durable.write_sealed

    def writing(path: Path, record: dict[str, Any]) -> None:
        written.append(path)
        write(path, record)

    monkeypatch.setattr(durable, "write_sealed", writing)
    monkeypatch.setattr("time.sleep", lambda seconds: pytest.fail("it waited"))
    record = begin(tmp_path, "any", [], {})
    runner.Runner(planner, record, Silent()).run()
    assert written == [tmp_path / MARK, record_path(tmp_path, record.run)]
    assert [path.name for path in (tmp_path / "runs").iterdir()] == [f"{record.run}.json"], "a folder takes 4 KiB more"
    (kept,) = past_runs(tmp_path)
    assert kept["outcome"] == "done"
    assert [stage["status"] for stage in kept["stages"]] == ["cached"] * 3


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EROFS])
def test_on_a_full_disk_a_run_with_nothing_to_do_ends_well_and_is_not_recorded(
    toy: ToyProject, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    toy.run_json()
    before = sorted(path for path in toy.home.rglob("*") if path.is_file())
    shutil.rmtree(toy.home / "locks")
    (toy.home / MARK).unlink()  # as a home of 0.2, which is known by its records
    monkeypatch.chdir(toy.folder)
    monkeypatch.syspath_prepend(toy.folder / "lib")
    opened = os.open

    def full(path: Any, flags: int, *given: Any, **named: Any) -> int:
        if flags & os.O_CREAT and str(toy.home) in str(path):
            raise OSError(number, os.strerror(number), str(path))
        return opened(path, flags, *given, **named)

    def refuse(*given: Any, **named: Any) -> None:
        raise OSError(number, os.strerror(number))

    store = Store(toy.home)
    outcomes = past_runs(toy.home)[0]["stages"]

    def look_up(spec: Any, inputs: dict[str, str], *, forced: bool) -> StagePlan:
        key = next(one["key"] for one in outcomes if one["name"] == spec.name)
        return StagePlan(spec, key, {}, store.find(spec.name, key), ())

    stages = [
        SimpleNamespace(name=one["name"], needs={}, declaration=SimpleNamespace(name="x", headline=()))
        for one in outcomes
    ]
    planner: Any = SimpleNamespace(
        pipeline=SimpleNamespace(stages=stages), store=store, look_up=look_up, remember=lambda plan: None
    )
    with monkeypatch.context() as patch:
        patch.setattr(os, "open", full)
        patch.setattr(os, "replace", refuse)
        patch.setattr(os, "mkdir", refuse)
        record = begin(toy.home, "toy", [], {})
        runner.Runner(planner, record, Silent()).run()
    assert (record.outcome, record.is_recorded, record.document()["recorded"]) == ("done", False, False)
    assert next_step(record) == f"not recorded: {toy.home} cannot be written"
    assert {path.name for path in before} >= {path.name for path in toy.home.rglob("*") if path.is_file()}
