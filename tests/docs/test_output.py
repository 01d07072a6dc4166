"""The output that pages show is what their commands print."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs import output
from tests.docs.measure import ROOT

pytest.importorskip("pyte", reason="reads the screen of a terminal: pip install '.[test]'")
CHEAP = [path for path in output.shown() if output.SLOW not in path.read_text()]
SLOW = [path for path in output.shown() if path not in CHEAP]


def check(page: Path) -> None:
    """Raise AssertionError where a page shows something that its commands do not print."""
    text = page.read_text()
    assert output.comparable(output.refreshed(text)) == output.comparable(text), (
        f"python -m tests.docs.output --write {page}"
    )


@pytest.mark.parametrize("page", CHEAP, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_a_page_shows_what_its_commands_print(page: Path) -> None:
    check(page)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("page", SLOW, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_a_page_of_long_commands_shows_what_they_print(page: Path) -> None:
    check(page)


def test_a_block_is_run_in_order_in_one_folder_on_a_terminal_of_80_columns() -> None:
    page = (
        "Text\n\n<!-- before: echo hidden > one.txt -->\n\n```{code-block} console\n$ cat one.txt\nold\n$ tput cols\n"
        "```\n\n"
        "```{code-block} console\n$ printf '1\\r2\\n\\033[31mred\\033[0m\\n'; pwd\n```\nend\n"
    )
    assert output.refreshed(page) == (
        "Text\n\n<!-- before: echo hidden > one.txt -->\n\n```{code-block} console\n$ cat one.txt\nhidden\n"
        "$ tput cols\n80\n"
        "```\n\n```{code-block} console\n$ printf '1\\r2\\n\\033[31mred\\033[0m\\n'; pwd\n2\nred\n"
        "~/kendama-first\n```\nend\n"
    )


def test_times_sizes_paths_and_blanks_do_not_count_but_numbers_do() -> None:
    one = "adapt   done in 12.3 s,  1.2 MB in /tmp/a/b.html  2026-11-25 21:30:11 0:01:02 caught 30 of 30 3fa9c01"
    two = "adapt done in 9 s, 830 kB in .kendama/x.html 2027-01-01 00:00:00 0:00:59 caught 30 of 30 11aa22b"
    other = one.replace("30 of", "29 of")
    assert output.comparable(one) == output.comparable(two) != output.comparable(other)
