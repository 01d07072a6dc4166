"""The table of continued learning in docs is what its program makes of the file of seeds, which it remakes."""

from __future__ import annotations

import csv

import pytest

from tests.benchmarks.continued import METRICS, TWINS, measured, read, table
from tests.benchmarks.learning import DATA


def test_the_table_in_docs_is_made_of_the_seeds() -> None:
    with (DATA / "continued_learning.csv").open(newline="") as file:
        assert list(csv.reader(file)) == table(read())


@pytest.mark.slow
@pytest.mark.parametrize("twin", TWINS)
def test_a_row_is_measured_as_it_stands(twin: str) -> None:
    line = min(
        (one for one in read() if one["twin"] == twin and one["rollouts_to_solved"]), key=lambda one: one[METRICS[3]]
    )
    assert measured(twin, int(line["seed"])) == pytest.approx({name: line[name] for name in METRICS})
