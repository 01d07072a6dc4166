"""A run whose results are all there waits for nothing, and writes one record."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from kendama_cli.pipeline import runner
from kendama_cli.pipeline.plan import StagePlan
from kendama_cli.pipeline.record import begin, past_runs
from kendama_cli.store import durable
from kendama_cli.store.home import MARK
from kendama_cli.store.runs import record_path
from kendama_cli.store.store import Store, StoredResult


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
