"""The figures and tables of a report as files: the same bytes again, the data behind them, nothing missing."""

from __future__ import annotations

import csv
import io
import re

import pytest

from kendama_cli.log.messages import RolloutMessage
from kendama_cli.report.export import Files
from kendama_cli.report.page import make_report
from kendama_cli.report.plot import COLUMN_IN, PAGE_IN, drawing, drawn_for_print
from kendama_cli.report.source import StageLog


@pytest.fixture(scope="module", name="some")
def some_stages(run, logs):
    """A run of two stages: all of them would take a minute."""
    names = ("encode", "learn")
    return {**run, "stages": [one for one in run["stages"] if one["name"] in names]}, {
        name: logs[name] for name in names
    }


def exported(run, logs) -> dict[str, bytes]:
    files = Files()
    with drawn_for_print(files.figure):
        make_report(run, logs)
    return files.made


@pytest.fixture(scope="module")
def made(some) -> dict[str, bytes]:
    return exported(*some)


def test_every_plot_of_the_page_is_there_thrice(some, made):
    plots = make_report(*some).count('<svg class="plot"')
    names = {name.partition(".")[0] for name in made}
    assert len(names) == plots > 5
    assert set(made) == {f"{name}.{suffix}" for name in names for suffix in ("svg", "pdf", "csv")}


def test_the_same_logs_give_the_same_bytes(some, made):
    again = exported(*some)
    assert [name for name in made if again[name] != made[name]] == []


def test_the_data_behind_the_reward_is_that_of_the_log(logs, made):
    rewards = StageLog(logs["learn"]).table("/learn/rollout", RolloutMessage).reward
    rows = list(csv.DictReader(io.StringIO(made["learn-reward.csv"].decode())))
    drawn = [float(row["y"]) for row in rows if row["series"].startswith(("explored", "greedy"))]
    assert {row["y_label"] for row in rows} == {"reward"}
    assert sorted(drawn) == sorted(rewards)


def test_figures_fit_a_column_and_carry_their_fonts(made):
    for name, content in made.items():
        if name.endswith(".svg"):
            head = content[:2000].decode()
            width = float(re.search(r'width="([\d.]+)pt"', head)[1]) / 72
            assert width == pytest.approx(COLUMN_IN, abs=0.01) or width == pytest.approx(PAGE_IN, abs=0.01)
            assert b"<text" not in content, "letters are outlines"
        if name.endswith(".pdf"):
            assert b"/FontFile2" in content
            assert b"/Type3" not in content
            assert b"CreationDate" not in content


def test_a_table_is_exact_as_csv_and_readable_as_latex():
    files = Files()
    files.metrics("learn", {"frozen_rate": 0.98765432, "position_error_mm_p50": -1.5, "learned": True, "n_runs": None})
    rows = list(csv.reader(io.StringIO(files.made["learn-metrics.csv"].decode())))
    assert rows[1] == ["frozen rate", "", "0.98765432"]
    assert rows[2] == ["position error, median", "mm", "-1.5"]
    text = files.made["learn-metrics.tex"].decode()
    assert r"frozen rate &  & 0.9877 \\" in text
    assert r"position error, median & mm & $-$1.5 \\" in text
    assert text.count("&") == 2 * 5


def test_bars_and_images_tell_their_values():
    files = Files()
    with drawn_for_print(files.figure), drawing("both", "") as made:
        upper, lower = made.axes(2)
        upper.bar([1.0, 2.0], [3.0, 4.0])
        lower.imshow([[1.0, 2.0], [3.0, 4.0]], origin="lower", extent=(0, 2, 0, 2))
    rows = list(csv.reader(io.StringIO(files.made["both.csv"].decode())))[1:]
    assert [(float(row[4]), float(row[5])) for row in rows if row[3] == "bars"] == [(1.0, 3.0), (2.0, 4.0)]
    assert [tuple(map(float, row[4:])) for row in rows if row[3] == "image"] == [
        (0.5, 0.5, 1.0),
        (1.5, 0.5, 2.0),
        (0.5, 1.5, 3.0),
        (1.5, 1.5, 4.0),
    ]
