"""The table of bench is what its program makes of the measured seeds, and a seed measured anew is the same."""

from __future__ import annotations

import csv

import pytest

from tests.plugins.bench import rows

LINES = rows.read()


def test_the_table_of_docs_is_made_of_the_measured_seeds() -> None:
    with (rows.DATA / "bench.csv").open(newline="") as file:
        assert list(csv.reader(file)) == rows.table(LINES)


def test_every_environment_has_the_seeds_that_are_named() -> None:
    for environment, entry in rows.DOCUMENT["environments"].items():
        seeds = [line["seed"] for line in LINES if line["environment"] == environment]
        named = range(rows.DOCUMENT["from"], rows.DOCUMENT["from"] + entry["seeds"])
        assert seeds == list(named)[: len(seeds)]


def test_a_seed_measured_anew_gives_the_same() -> None:
    """The one with the fewest actions: any of them would do."""
    known = min((line for line in LINES if line["environment"] == "CartPole-v1"), key=lambda line: line["steps"])
    found = rows.table_learned("CartPole-v1", int(known["seed"]))
    for name in rows.METRICS:
        assert found[name] == pytest.approx(known[name], rel=1e-9)
