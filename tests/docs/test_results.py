"""Tables of the results pages that stand as CSV: well formed, shown by one page, and naming what exists."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest

from tests.docs import measure
from tests.docs.test_names import problem

RESULTS = measure.DOCS / "results"
TABLES = sorted((RESULTS / "data").glob("*.csv"))


def rows_of(path: Path) -> list[list[str]]:
    return list(csv.reader(path.read_text().splitlines()))


def test_every_table_is_shown_by_one_page() -> None:
    pages = [path.read_text() for path in RESULTS.glob("*.md")]
    shown = [name for text in pages for name in re.findall(r"^\[Table: [^\]]+\]\(data/(\w+)\.csv\)$", text, re.M)]
    assert sorted(shown) == [path.stem for path in TABLES]


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_a_table_has_full_rows_with_what_was_measured(path: Path) -> None:
    head, *rows = rows_of(path)
    assert rows
    assert {len(row) for row in rows} == {len(head)}
    assert [cell for row in rows for cell in row if measure.count(cell) > measure.CELL] == []
    assert all(row[0] for row in rows)
    assert all(any(re.search(r"\d|never|none", cell) for cell in row[1:]) for row in rows)
    missing = [
        found
        for row in rows
        for cell in row
        for span in re.findall(r"`([^`]+)`", cell)
        if (found := problem(span, RESULTS / "page.md"))
    ]
    assert missing == []


@pytest.mark.parametrize("page", sorted(RESULTS.glob("*.md")), ids=lambda path: path.name)
def test_a_command_that_a_table_names_is_listed_on_its_page(page: Path) -> None:
    for block in page.read_text().split("\n## "):
        tables = [rows_of(RESULTS / "data" / f"{name}.csv") for name in re.findall(r"\(data/(\w+)\.csv\)", block)]
        listed = set(re.findall(r"^- ([a-z]):", block, re.M))
        for head, *rows in tables:
            if "command" in head:
                named = {one for row in rows for one in re.findall(r"\b[a-h]\b", row[head.index("command")])}
                assert named <= listed, page.name
