"""Past runs: chosen, sorted, tagged and compared; a stage's log and artifact found by RUN/STAGE."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from kendama_cli.cli import completion
from kendama_cli.pipeline import record as record_module
from kendama_cli.pipeline.run_diff import run_differences
from kendama_cli.pipeline.run_facts import RECORDED, Condition, FactReader, condition, in_order
from kendama_cli.store import durable
from kendama_cli.store.store import Store
from tests.toy_project import ToyProject


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> ToyProject:
    """Three runs: two seeds, and the first seed with more steps."""
    toy = ToyProject(tmp_path_factory.mktemp("toy"))
    for overrides in (["seed=1"], ["seed=2"], ["seed=1", "toy.steps=6"]):
        toy.run_json(*overrides)
    return toy


def shown(toy: ToyProject, *arguments: str) -> list[list[str]]:
    return [line.split() for line in toy.kendama(*arguments).stdout.splitlines()[1:]]


def ids(toy: ToyProject, *arguments: str) -> list[int]:
    return [int(row[0].partition("-")[0]) for row in shown(toy, "runs", *arguments)]


def test_runs_are_chosen_by_configuration_metric_and_record(done: ToyProject) -> None:
    assert ids(done) == [1, 2, 3]
    assert ids(done, "--filter", "toy.steps<10") == [3]
    assert ids(done, "--filter", "seed=1") == [1, 3]
    assert ids(done, "--filter", "seed=1", "--filter", "overrides~steps") == [3]
    assert ids(done, "--filter", "outcome!=done") == []


def test_runs_are_sorted_and_show_what_is_asked_for(done: ToyProject) -> None:
    sums = {row[0]: float(row[1]) for row in shown(done, "runs", "--columns", "roll.sum")}
    rows = shown(done, "runs", "--sort", "roll.sum", "--columns", "roll.sum,toy.steps")
    assert [row[0] for row in rows] == sorted(sums, key=lambda run: sums[run])
    assert {row[2] for row in rows} == {"20", "6"}


def test_tags_and_a_note_are_kept_found_and_taken_away(done: ToyProject) -> None:
    done.kendama("runs", "tag", "2", "good", "for-paper", "--note", "the one of figure 3")
    assert ids(done, "--filter", "tags~for-paper") == [2]
    assert json.loads(done.kendama("runs", "--json", "--filter", "note~figure").stdout)[0]["tags"] == [
        "good",
        "for-paper",
    ]
    left = done.kendama("runs", "tag", "2", "--remove", "good").stdout
    assert left.partition(": ")[2] == "for-paper; the one of figure 3\n"
    assert done.kendama("cache", "verify").returncode == 0


def test_runs_whose_record_is_damaged_are_counted_aloud(tmp_path: Path) -> None:
    toy = ToyProject(tmp_path)
    for steps in (2, 3):
        toy.run_json(f"toy.steps={steps}")
    first, second = sorted(toy.home.glob("runs/*.json"))
    first.write_text("[1]")
    listed = toy.kendama("runs")
    assert [row.split()[0] for row in listed.stdout.splitlines()[1:]] == [second.stem]
    assert listed.stderr == (
        f"runs in {toy.home} whose record cannot be read: 1; 'kendama cache verify' says which and why\n"
        "home: .kendama\n"
    )
    second.write_text("")
    error = toy.kendama("report", expect=2).stderr
    assert "whose record cannot be read: 2; 'kendama cache verify'" in error


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["runs", "--filter", "toy.steps"], "not a condition"),
        (["runs", "--filter", "toy.step>1"], "no run has 'toy.step': .* did you mean 'toy.steps'"),
        (["runs", "--columns", "roll.summe"], "no run has 'roll.summe'"),
        (["runs", "--sort", "nothing"], "no run has 'nothing'"),
        (["runs", "tag", "2", "a b"], "tag 'a b': letters"),
        (["runs", "tag", "2", "--remove", "other"], "has no tag 'other'"),
        (["diff", "1", "99"], "no run '99'"),
        (["cache", "path", "1/nope"], "has no stage 'nope'; it has: roll, total"),
        (["log", "info", "7/roll"], "no run '7'"),
    ],
)
def test_what_there_is_not_is_told_in_one_line(done: ToyProject, arguments: list[str], message: str) -> None:
    error = done.kendama(*arguments, expect=2).stderr
    assert len(error.splitlines()) == 1
    assert re.search(message, error), error


def test_diff_says_what_differs_and_nothing_else(done: ToyProject) -> None:
    document = json.loads(done.kendama("diff", "1", "3", "--json").stdout)
    assert document["config"] == {"toy.steps": [20, 6]}
    assert document["code"] == []
    assert document["versions"] == {}
    assert document["artifacts"] == {"roll": "differs", "total": "differs"}
    assert "roll.sum" in document["metrics"]
    same = json.loads(done.kendama("diff", "1", "1", "--json").stdout)
    assert same["config"] == same["metrics"] == same["intervals"] == {}
    assert set(same["artifacts"].values()) == {"the same"}
    assert "toy.steps: 20 -> 6" in done.kendama("diff", "1", "3").stdout


def test_metrics_with_bounds_are_compared_by_them(tmp_path: Path) -> None:
    def record(rate: float, low: float, high: float) -> dict[str, object]:
        metrics = {"rate": rate, "rate_low": low, "rate_high": high}
        return {"run": "1", "stages": [{"name": "a", "key": None, "artifact": None, "metrics": metrics}]}

    near = run_differences(Store(tmp_path), record(0.9, 0.8, 0.95), record(0.96, 0.9, 0.99))
    assert near["intervals"]["a.rate"]["overlap"] is True
    far = run_differences(Store(tmp_path), record(0.5, 0.4, 0.6), record(0.96, 0.9, 0.99))
    assert far["intervals"]["a.rate"]["overlap"] is False


def test_a_log_and_an_artifact_are_found_by_run_and_stage(done: ToyProject) -> None:
    folder = Path(done.kendama("cache", "path", "1/roll").stdout.strip())
    assert (folder / "log.mcap").is_file()
    by_stage = json.loads(done.kendama("log", "info", "1/roll", "--json").stdout)
    by_file = json.loads(done.kendama("log", "info", str(folder / "log.mcap"), "--json").stdout)
    assert by_stage == by_file
    newest = json.loads(done.kendama("log", "info", "roll", "--json").stdout)
    assert newest == json.loads(done.kendama("log", "info", "3/roll", "--json").stdout)
    assert newest != by_stage


def test_numbers_are_compared_as_numbers_and_text_as_text() -> None:
    facts = {"a": 10, "b": "x10", "c": "0.5"}
    assert condition("a>9").holds(facts)
    assert not condition("a<9.5").holds(facts)
    assert condition("b=x10").holds(facts)
    assert condition("c<=0.50").holds(facts)
    assert not condition("d=1").holds(facts)
    assert condition(" a >= 10 ") == Condition("a", ">=", "10")


def test_runs_without_the_key_come_last() -> None:
    runs = [{"run": "1"}, {"run": "2", "k": 10}, {"run": "3", "k": 9}]
    assert [one["run"] for one in in_order(runs, "k")] == ["3", "2", "1"]


def test_what_is_read_of_a_run_is_what_its_result_and_record_say(tmp_path: Path) -> None:
    words = 'x, "parts": {"stage": ", "config": {"learn": {"alpha": 9}}'
    config = {"learn": {"alpha": 0.5, "words": words, "none": None, "list": [1, 2]}, "seed": 3}
    parts = {"stage": "a:B", "returns": "c:D", "config": config, "inputs": {}, "code": {}}
    metrics = {"parts": 1, "config": words, "rate.mean": 0.25, "by": {"cup": {"mm": 4}}}
    stage = {"name": "learn", "key": "0" * 40, "metrics": metrics}
    store = Store(tmp_path)
    durable.write_sealed(store.result_path("learn", "0" * 40), {"metrics": metrics, "parts": parts})
    record = {"run": "00001-abcdef", "overrides": ["a=1"], "stages": [stage], "pipeline": "p", "started": "2026"}
    expected = {
        "learn.alpha": 0.5, "learn.words": words, "learn.list": "1,2", "seed": 3,
        "learn.rate.mean": 0.25, "learn.by.cup.mm": 4, "learn.parts": 1, "learn.config": words,
    }  # fmt: skip
    reader = FactReader(store, [*expected, "learn.none", "learn", "game.alpha", "learn.by"])
    for _ in range(2):
        facts = reader.facts(record)
        assert {key: value for key, value in facts.items() if key not in RECORDED} == expected
    assert reader.all_keys(record) >= expected.keys()


def test_runs_print_one_json_list_whatever_their_number(done: ToyProject) -> None:
    printed = done.kendama("runs", "--json").stdout
    assert printed == json.dumps(json.loads(printed), indent=2, ensure_ascii=False) + "\n"
    assert json.loads(done.kendama("runs", "--json", "--filter", "outcome!=done").stdout) == []


def test_words_are_completed_from_names_and_few_records(done: ToyProject, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KENDAMA_HOME", str(done.home))
    monkeypatch.chdir(done.folder)
    names = [json.loads(path.read_text())["record"]["run"] for path in sorted(done.home.glob("runs/*.json"))]
    assert completion.runs("") == names[::-1]
    assert completion.artifacts(names[0]) == [f"{names[0]}/roll", f"{names[0]}/total"]
    read: list[str] = []
    monkeypatch.setattr(record_module, "read_run", lambda home, run: read.append(run))
    completion.runs("0")
    assert read == []
    completion.artifacts(names[1])
    assert read == [names[-1], names[1]]
