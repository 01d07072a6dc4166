"""Sweeps: one run for each distinct combination, shared stages once, failures apart, only what is missing."""

from __future__ import annotations

import json
from typing import Any

from tests.toy_project import ToyProject


def sweep(toy: ToyProject, *overrides: str, expect: int = 0) -> list[dict[str, Any]]:
    done = toy.kendama("sweep", "-p", "toy", "--json", *overrides, expect=expect)
    return list(json.loads(done.stdout)["runs"])


def test_lists_and_ranges_make_one_run_per_combination(toy: ToyProject) -> None:
    runs = sweep(toy, "seed=range(0,3)", "toy.steps=2,3")
    assert [run["overrides"] for run in runs] == [
        [f"seed={seed}", f"toy.steps={steps}"] for seed in (0, 1, 2) for steps in (2, 3)
    ]
    assert all(stage["status"] == "ran" for run in runs for stage in run["stages"])
    assert len({run["stages"][0]["metrics"]["sum"] for run in runs}) == 6


def test_choice_and_glob_work_and_equal_combinations_run_once(toy: ToyProject) -> None:
    (toy.folder / "conf/toy/other.yaml").write_text((toy.folder / "conf/toy/default.yaml").read_text())
    (toy.folder / "pipelines/toy.yaml").write_text(
        (toy.folder / "pipelines/toy.yaml").read_text().replace('["+toy=default"]', "[]")
    )
    runs = sweep(toy, "+toy=glob(*)", "seed=choice(1,1,2)")
    assert len(runs) == 2, "two groups of equal content and a seed given twice are two runs, not six"


def test_a_shared_stage_is_computed_once(toy: ToyProject) -> None:
    (toy.folder / "pipelines/toy.yaml").write_text(
        (toy.folder / "pipelines/toy.yaml")
        .read_text()
        .replace("needs: [roll], config: [toy]", "needs: [roll], config: {toy: game}")
    )
    count = toy.folder / "count"
    runs = sweep(toy, f"toy.count_file={count}", "game.rope.length_m=0.3,0.4,0.5")
    assert count.read_text() == "x" * 20
    assert sorted(run["stages"][0]["status"] for run in runs) == ["cached", "cached", "ran"]
    assert [run["stages"][1]["status"] for run in runs] == ["ran"] * 3


def test_a_failed_job_stops_no_other_and_a_second_sweep_does_only_what_is_missing(toy: ToyProject) -> None:
    runs = sweep(toy, "toy.fail_at=-1,3", "seed=1,2", expect=1)
    assert [run["outcome"] for run in runs] == ["done", "done", "failed", "failed"]
    assert "told to fail at 3" in runs[2]["stages"][0]["error"]
    again = sweep(toy, "toy.fail_at=-1,3", "seed=1,2,3", expect=1)
    assert [run["stages"][0]["status"] for run in again] == ["cached", "cached", "ran", "failed", "failed", "failed"]


def test_a_sweep_over_a_key_that_the_pipeline_does_not_read_is_one_run(toy: ToyProject) -> None:
    assert len(sweep(toy, "learn.alpha=0.1,0.2")) == 1


def test_a_wrong_value_is_told_before_anything_runs(toy: ToyProject) -> None:
    done = toy.kendama("sweep", "-p", "toy", "toy.steps=2,0", expect=2)
    assert done.stderr == "kendama: 'toy.steps' is 0; allowed: at least 1\n"
    assert not (toy.home / "runs").exists()
