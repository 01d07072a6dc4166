"""Runs by sweep, range and ``last``; their metrics in rows over seeds, as text, Markdown and CSV; groups compared."""

from __future__ import annotations

import csv
import io
import json
import re

import numpy as np
import pytest
from scipy.stats import binomtest

from kendama_cli.pipeline.run_selection import named_sweep, select_runs, sweep_names
from kendama_cli.report.intervals import mean_interval
from kendama_cli.report.run_table import RunFacts, estimate, rounded
from kendama_cli.store import durable
from tests.toy_project import ToyProject


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> ToyProject:
    """A run alone (1), a named sweep (2 to 5), one without a name (6 and 7)."""
    toy = ToyProject(tmp_path_factory.mktemp("toy"), alone=True)
    toy.run_json("seed=7")
    toy.kendama("sweep", "-p", "toy", "--name", "steps-study", "toy.steps=2,3", "seed=1,2")
    toy.kendama("sweep", "-p", "toy", "toy.steps=4", "seed=1,2")
    return toy


def numbers(toy: ToyProject, *arguments: str) -> list[int]:
    lines = toy.kendama("runs", *arguments).stdout.splitlines()[1:]
    return [int(line.partition("-")[0]) for line in lines]


def test_sweeps_ranges_and_last_choose_runs_alone_and_mixed(done: ToyProject) -> None:
    assert numbers(done) == [1, 2, 3, 4, 5, 6, 7]
    assert numbers(done, "sweep:steps-study") == [2, 3, 4, 5]
    assert numbers(done, "last") == [6, 7]
    assert numbers(done, "1..3", "7") == [1, 2, 3, 7]
    assert numbers(done, "sweep:steps-study", "4..6", "--filter", "seed=2") == [3, 5]
    assert numbers(done, "--filter", "sweep=steps-study") == [2, 3, 4, 5]


def test_a_sweep_without_a_name_is_called_by_day_and_what_varies(done: ToyProject) -> None:
    made = sweep_names(done.home)
    assert made[0] == "steps-study"
    assert re.fullmatch(r"\d{4}-\d\d-\d\d-seed", made[1])
    again = named_sweep(done.home, None, ["seed=1,2"], ["seed"], made[1][:10])
    assert again == f"{made[1]}-n2"


def test_a_repeated_sweep_counts_each_combination_once(tmp_path) -> None:
    toy = ToyProject(tmp_path, alone=True)
    for _ in range(2):
        toy.kendama("sweep", "-p", "toy", "--name", "twice", "toy.steps=2", "seed=1,2")
    found = select_runs(toy.home, ["sweep:twice"])
    assert [int(one["run"][:5]) for one in found] == [3, 4]


def test_runs_of_before_sweeps_had_names_are_listed_and_chosen(tmp_path) -> None:
    toy = ToyProject(tmp_path, alone=True)
    toy.run_json("toy.steps=2")
    (path,) = toy.home.glob("runs/*.json")
    assert "sweep" not in json.loads(path.read_text()), "a run alone is written as ever"
    assert numbers(toy) == numbers(toy, "last") == numbers(toy, "1..9") == [1]
    assert "no run here belongs to one" in toy.kendama("runs", "sweep:any", expect=2).stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["report", "sweep:step-study"], "no sweep 'step-study' in .*did you mean 'steps-study'"),
        (["runs", "9..12"], r"9\.\.12: no run in .* runs 1\.\.7 are there"),
        (["runs", "5..2"], r"type 2\.\.5"),
        (["diff", "sweep:nothing"], "no sweep 'nothing'"),
        (["runs", "--table", "--columns", "roll.summ"], "no metric of these runs, did you mean 'roll.sum'"),
        (["runs", "--precision", "3"], "add --table"),
        (["runs", "--table", "last", "--filter", "seed=9"], "none of 2 runs meets seed=9"),
        (["sweep", "-p", "toy", "--name", "last", "seed=1,2"], "--name last: letters"),
        (["sweep", "-p", "toy", "--name", "7", "seed=1,2"], "--name 7: letters"),
    ],
)
def test_what_chooses_no_run_is_told_in_one_line(done: ToyProject, arguments: list[str], message: str) -> None:
    error = done.kendama(*arguments, expect=2).stderr
    assert len(error.splitlines()) == 1
    assert re.search(message, error), error


def test_the_table_has_a_row_for_what_differs_and_intervals_over_seeds(done: ToyProject) -> None:
    printed = done.kendama("runs", "--table", "sweep:steps-study", "--csv", "--columns", "roll.sum").stdout
    rows = list(csv.DictReader(io.StringIO(printed)))
    assert [(row["toy.steps"], row["seeds"], row["runs"]) for row in rows] == [("2", "1 2", "2"), ("3", "1 2", "2")]
    records = select_runs(done.home, ["2..3"])
    values = np.array([record["stages"][0]["metrics"]["sum"] for record in records])
    low, high = mean_interval(values) or (0.0, 0.0)
    assert float(rows[0]["roll.sum"]) == pytest.approx(np.median(values), abs=1e-15)
    assert rows[0]["roll.sum_low"] == "", "two values have no interval of the median"
    assert float(rows[0]["roll.sum_mean"]) == pytest.approx(values.mean(), abs=1e-15)
    assert (float(rows[0]["roll.sum_mean_low"]), float(rows[0]["roll.sum_mean_high"])) == (low, high)
    markdown = done.kendama("runs", "--table", "sweep:steps-study", "--md", "--columns", "roll.n", "--precision", "2")
    assert markdown.stdout.splitlines()[2:] == ["| 2 | 2 | 2; mean 2 [2, 2] |", "| 3 | 2 | 3; mean 3 [3, 3] |"]
    told = done.kendama("runs", "--table", "sweep:steps-study").stdout.splitlines()
    assert told[0].split() == ["toy.steps", "runs", "roll.sum"], "the headline metric"


def test_two_groups_of_runs_are_compared_by_their_intervals(done: ToyProject) -> None:
    document = json.loads(done.kendama("diff", "2..3", "4..5", "--json").stdout)
    assert document["overrides"] == {"toy.steps": ["2", "3"]}
    assert document["intervals"]["roll.n"] == {"values": [2.0, 3.0], "bounds": [[2.0] * 2, [3.0] * 2], "overlap": False}
    told = done.kendama("diff", "sweep:steps-study", "last").stdout
    assert told.splitlines()[0] == "sweep:steps-study (4 runs) -> last (2 runs)"


def facts(run: str, artifact: str, **metrics: object) -> RunFacts:
    return RunFacts(run, {}, {f"a.{name}": value for name, value in metrics.items()}, {"a": artifact})


def test_a_shared_result_counts_once_and_yes_or_no_has_the_exact_interval() -> None:
    runs = [facts("1", "x", solved=True), facts("2", "x", solved=True), facts("3", "y", solved=False)]
    found = estimate(runs, "a.solved")
    exact = binomtest(1, 2).proportion_ci(method="exact")
    assert found is not None
    assert (found.value, found.n) == (0.5, 2)
    assert (found.low, found.high) == pytest.approx((exact.low, exact.high), abs=1e-9)
    alone = estimate([facts("1", "x", rate=0.9, rate_low=0.8, rate_high=0.95)], "a.rate")
    assert alone is not None
    assert alone.text(3) == "0.9 [0.8, 0.95]"


def test_the_median_leads_and_a_mean_with_runs_at_the_cap_says_how_many() -> None:
    solved = [40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 1000.0]
    runs = [
        RunFacts(str(n), {}, {"learn.rollouts_to_solved": value, "learn.solved": value < 1000}, {})
        for n, value in enumerate(solved)
    ]
    found = estimate(runs, "learn.rollouts_to_solved")
    assert found is not None
    assert found.text(3) == "70 [40, 1000]"
    assert re.fullmatch(r"70 \[40, 1000\]; mean 199 \[.+\], 1 at the cap", found.texts(3))


def test_numbers_keep_the_digits_that_are_asked_for() -> None:
    assert [rounded(value, 3) for value in (1234.5, 0.0123456, 1e-7, 0.0, -2.0)] == [
        "1230",
        "0.0123",
        "1.00e-07",
        "0",
        "-2",
    ]


def test_the_record_of_a_sweep_is_sealed_with_its_name(done: ToyProject) -> None:
    sealed = [durable.read_sealed(path) for path in sorted(done.home.glob("runs/*.json"))]
    assert [one.get("sweep", "") for one in sealed if one][:5] == ["", *["steps-study"] * 4]
