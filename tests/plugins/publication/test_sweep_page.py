"""The report over several runs: groups, intervals, failures by seed, and the table over bodies, from logs alone."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from kendama_cli.errors import InputError
from kendama_cli.report.ensemble import ensemble
from kendama_cli.report.source import StageLog
from kendama_cli.report.sweep_page import make_sweep_report
from kendama_cli.stages.adapt.messages import AdaptRepeatMessage, AdaptRolloutMessage
from tests.log.made_logs import memory_log
from tests.report.synthetic_run import write_run
from tests.report.synthetic_sweep import TWINS, write_explorations, write_transfers
from tests.report.test_page import _Balance


@pytest.fixture(scope="module")
def explorations(tmp_path_factory):
    return write_explorations(tmp_path_factory.mktemp("explorations"))


@pytest.fixture(scope="module")
def transfers(tmp_path_factory):
    return write_transfers(tmp_path_factory.mktemp("transfers"))


@pytest.fixture(scope="module")
def exploration_page(explorations):
    return make_sweep_report("made up", explorations)


@pytest.fixture(scope="module")
def transfer_page(transfers):
    return make_sweep_report("made up", transfers)


def _text(page: str) -> str:
    page = re.sub(r"<(style|svg).*?</\1>", " ", page, flags=re.DOTALL)
    return " ".join(re.sub(r"<[^>]+>", " ", page).split())


def test_runs_are_grouped_by_what_differs_but_the_seed(explorations):
    found = ensemble(explorations, "learn", ())
    assert found.differs == "learn/learner"
    assert [group.label for group in found.groups] == ["sarsa", "epsilon_greedy"]
    assert [[member.seed for member in group.members] for group in found.groups] == [[str(n) for n in range(20)]] * 2


def test_an_override_that_only_some_runs_have_parts_them(explorations):
    runs = [
        ({**document, "overrides": [*document["overrides"], *(["learn.alpha=0.3"] if place % 2 else [])]}, logs)
        for place, (document, logs) in enumerate(explorations[:4])
    ]
    assert [group.label for group in ensemble(runs, "learn", ()).groups] == ["as configured", "0.3"]
    assert [group.legend for group in ensemble(runs, "learn", ()).groups] == ["as configured", "learn.alpha=0.3"]


def test_a_log_that_runs_share_counts_once_under_what_they_agree_on(transfers):
    found = ensemble(transfers, "learn", ())
    assert [len(group.members) for group in found.groups] == [3]
    assert found.differs == ""
    assert [len(group.members) for group in ensemble(transfers, "transfer", ()).groups] == [3] * len(TWINS)


def test_figures_intervals_and_ratios_are_told(exploration_page, explorations):
    text = _text(exploration_page)
    values = [group.figures("rollouts_to_solved") for group in ensemble(explorations, "learn", ()).groups]
    for group in values:
        assert f"{group.mean():.3g}" in text
    assert f"{values[1].mean() / values[0].mean():.3g}" in text
    for title in (
        "to solved, interquartile mean",
        "to solved, median",
        "to solved, 90 %",
        "solved sooner",
        "ratio of means",
    ):
        assert title in text
    assert "Against sarsa" in text


def test_failures_are_listed_by_seed(exploration_page):
    assert "Unsolved (epsilon_greedy): seed 3." in _text(exploration_page)


def test_every_body_has_its_line_and_the_last_line_is_the_mean(transfer_page):
    text = _text(transfer_page)
    for twin in TWINS:
        assert twin in text
    assert "rope −10 %, lag 15 ms" in text
    assert "mean 2 15 0.133 85 % worst 85 % 97.5 % worst 97.5 % 75 % worst 75 %" in text
    assert "Not learned or caught: twin_rope_short from scratch: seed 2" in text


def test_a_run_that_failed_is_told_in_plain_text(transfer_page):
    assert "hardware=twin_lag_40 seed=3: the line is &lt;cut&gt;" in transfer_page


def test_two_processes_make_the_same_bytes(transfers, tmp_path):
    listed = [(document, {name: str(path) for name, path in logs.items()}) for document, logs in transfers]
    (tmp_path / "runs.json").write_text(json.dumps(listed))
    page = make_sweep_report("made up", transfers)
    made = subprocess.run(
        [sys.executable, "-m", "tests.report.synthetic_sweep", str(tmp_path / "runs.json")],
        check=True,
        cwd=Path(__file__).parents[3],
        capture_output=True,
        env={**os.environ, "PYTHONHASHSEED": "1", "PYTHONIOENCODING": "utf-8", "TZ": "UTC+1"},
    )
    assert made.stdout.decode() == page


def test_the_page_is_well_formed_and_asks_nothing_of_the_network(exploration_page, transfer_page):
    for page in (exploration_page, transfer_page):
        balance = _Balance()
        balance.feed(page)
        assert balance.open == []
        assert len(balance.ids) == len(set(balance.ids))
        for target in set(re.findall(r"""(?:href="|url\()#([^")]+)""", page)):
            assert target in balance.ids
        addresses = re.findall(r"""(?:src|href|url)\s*[=(]\s*["']?([^"')\s>]+)""", page)
        assert [one for one in addresses if not one.startswith(("#", "data:"))] == []


def test_searches_swings_repeats_and_errors_of_several_runs_lie_over_each_other(tmp_path):
    """Two robots and two detectors; each legend names override and value, and each group has its line in the tables."""
    _, logs = write_run(tmp_path)
    runs = []
    for robot in ("pa10", "iiwa"):
        own = {name: Path(shutil.copy(logs[name], tmp_path / f"{name}-{robot}.mcap")) for name in ("adapt", "predict")}
        stages = [{"name": name, "status": "ran"} for name in own]
        runs.append(({"pipeline": "kendama", "overrides": [f"robot={robot}"], "stages": stages}, own))
    page = make_sweep_report("made up", runs)
    plots = re.findall(r"<svg.*?</svg>", page, flags=re.DOTALL)
    assert len(plots) == 5
    for plot in plots:
        assert all(f"robot={robot}</text>" in plot for robot in ("pa10", "iiwa"))
    repeats = StageLog(logs["adapt"]).table("/adapt/repeat", AdaptRepeatMessage)
    assert f"{len(repeats)} {100 * repeats['caught'].mean():.1f}".removesuffix(".0") + " %" in _text(page)
    alone = make_sweep_report("made up", runs[:1])
    assert "robot=pa10</text>" not in alone


def test_a_plot_that_one_point_cannot_fill_is_left_out(tmp_path):
    log = memory_log()
    log.write("/adapt/repeat", 0.0, AdaptRepeatMessage(0, True, 0.004))
    log.write("/adapt/rollout", 0.0, AdaptRolloutMessage(0, 1.1, 0.004, True, 1.0, 0.0, 0.0))
    log.finish(tmp_path / "adapt.mcap", stage="adapt", settings={}, metrics={"tau_scale": 1.1, "success_rate": 1.0})
    stages = [{"name": "adapt", "status": "ran"}]
    runs = [({"overrides": [], "stages": stages}, {"adapt": tmp_path / "adapt.mcap"})]
    page = make_sweep_report("made up", runs)
    assert "<svg" not in page
    assert "1 100 %" in _text(page)


def test_a_stage_of_the_users_own_has_its_metrics_over_the_runs(tmp_path):
    runs = []
    for width in (3, 5):
        log = memory_log()
        path = tmp_path / f"{width}.mcap"
        log.finish(
            path, stage="smooth", settings={}, metrics={"n_kept": 10 * width, "rmse_mm": 0.5 * width, "kind": "a"}
        )
        document = {"overrides": [f"smooth.width={width}"], "stages": [{"name": "smooth", "status": "ran"}]}
        runs.append((document, {"smooth": path}))
    text = _text(make_sweep_report("", runs))
    assert "smooth.width logs number of kept rmse [mm] 3 1 30 1.5 5 1 50 2.5" in text


def test_one_run_alone_and_no_run_at_all_make_a_page(explorations):
    assert "all runs" in make_sweep_report("", explorations[:1])
    assert "0 runs" in make_sweep_report("", [])


def test_a_damaged_log_is_named(explorations, tmp_path):
    document, logs = explorations[0]
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(logs["learn"].read_bytes()[:-300])
    with pytest.raises(InputError, match=r"broken\.mcap"):
        make_sweep_report("", [(document, {"learn": broken})])


def test_where_runs_differ_in_a_setting_the_values_of_each_are_told(tmp_path):
    runs = []
    for task in ("hard", "paper"):
        log = memory_log()
        settings = {"smooth": {"task": task, "width": 3}}
        log.finish(tmp_path / f"{task}.mcap", stage="smooth", settings=settings, metrics={"n_kept": 1})
        document = {"overrides": [f"smooth.task={task}"], "stages": [{"name": "smooth", "status": "ran"}]}
        runs.append((document, {"smooth": tmp_path / f"{task}.mcap"}))
    text = _text(make_sweep_report("", runs))
    assert "smooth.task hard | paper smooth.width 3" in text


def test_where_groups_are_many_a_figure_that_few_of_them_have_is_no_headline(tmp_path):
    runs = []
    for kind, metrics in (
        ("sarsa", {"half_swings": 4.0}),
        ("random_replay", {"half_swings": 5.0}),
        ("energy_pumping", {}),
        ("random", {}),
    ):
        log = memory_log()
        log.finish(tmp_path / f"{kind}.mcap", stage="learn", settings={}, metrics=metrics)
        document = {"overrides": [f"learn/learner={kind}"], "stages": [{"name": "learn", "status": "ran"}]}
        runs.append((document, {"learn": tmp_path / f"{kind}.mcap"}))
    assert "half-swings to the goal, mean: sarsa" in make_sweep_report("made up", runs[:2])
    assert "half-swings to the goal, mean" not in make_sweep_report("made up", runs)


def test_what_makes_a_twin_hard_its_imitation_and_its_proof_are_told(tmp_path):
    metrics = {"rollouts": 1, "rollouts_to_solved": 60, "solved": False, "imitation_caught_rate": 0.95}
    made = {"rope_scale": 1.05, "rope_kg": None, "drag_scale": 3.0, "mass_scale": 1.0, "gravity_tilt_rad": 0.01745}
    settings = {"hardware": {"imperfection": made}, "transfer": {"imitation_repeats": 20}}
    log = memory_log()
    log.finish(tmp_path / "transfer.mcap", stage="transfer", settings=settings, metrics=metrics)
    document = {"overrides": ["hardware=hard", "seed=2"], "stages": [{"name": "transfer", "status": "ran"}]}
    text = _text(make_sweep_report("made up", [(document, {"transfer": tmp_path / "transfer.mcap"})]))
    assert "rope +5 %, air × 3, tilt 1° 1 1" in text
    assert "to solved imitation caught" in text
    assert "60 95 % 75 … 100" in text
    assert "to solved: seed 2" in text


def test_a_comparison_of_imitations_alone_tells_at_which_rollout_they_caught(tmp_path):
    runs = []
    for seed, caught_at in enumerate((2, 3, None)):
        log, path = memory_log(), tmp_path / f"{seed}.mcap"
        metrics = {"imitation_caught": caught_at is not None, "imitation_caught_at": caught_at}
        log.finish(path, stage="transfer", settings={}, metrics=metrics)
        document = {"overrides": ["hardware=hard", f"seed={seed}"], "stages": [{"name": "transfer", "status": "ran"}]}
        runs.append((document, {"transfer": path}))
    text = _text(make_sweep_report("made up", runs))
    assert "imitation caught at all runs 3" in text
    assert "2.5" in text
    assert "Not learned or caught: all runs imitation: seed 2" in text
