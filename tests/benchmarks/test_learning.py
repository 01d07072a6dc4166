"""The tables of learning are what their program makes of the measured seeds, and a seed measured anew is the same."""

from __future__ import annotations

import csv
import math

import pytest

from kendama_cli.config.site import find_site
from tests.benchmarks import learning

ROWS = list(learning.rows())
LINES = learning.read()
TABLES = list(dict.fromkeys(row.table for row in ROWS))


def lines_of(row: learning.Row) -> list[dict[str, object]]:
    return [line for line in LINES if (line["table"], line["row"]) == (row.table, row.name)]


@pytest.mark.parametrize("table", TABLES)
def test_the_tables_of_docs_are_made_of_the_measured_seeds(table: str) -> None:
    with (learning.DATA / f"{table}.csv").open(newline="") as file:
        assert list(csv.reader(file)) == learning.tables(LINES)[table]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row.table}-{row.name}")
def test_the_seeds_of_a_row_are_those_that_are_named(row: learning.Row) -> None:
    assert [line["seed"] for line in lines_of(row)] == list(row.seeds)[: len(lines_of(row))]


@pytest.mark.parametrize(
    "table", [pytest.param(one, marks=pytest.mark.slow) if one.startswith("peers") else one for one in TABLES]
)
def test_a_seed_measured_anew_gives_the_same(table: str) -> None:
    """The soonest solved of the table's last measured row: any of them would do."""
    row = [row for row in ROWS if row.table == table and lines_of(row)][-1]
    known = min(lines_of(row), key=lambda line: (line["rollouts_to_solved"], line["seed"]))
    (found,) = learning.measured(row, [int(str(known["seed"]).partition(".")[0])], find_site())
    for name in learning.METRICS:
        if not math.isnan(float(str(known[name]))):  # seeds measured before there was a catch by sight
            assert found[name] == pytest.approx(known[name], rel=1e-5), name
