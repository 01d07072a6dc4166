"""Sentences, words and tables of every page keep within their goals, or within what the page had when it was capped."""

from __future__ import annotations

import json

import pytest

from tests.docs import measure

MEASURED = [measure.measure(path) for path in measure.pages()]
CAPS = json.loads(measure.CAPS.read_text())


@pytest.mark.parametrize("page", MEASURED, ids=lambda page: page.name)
def test_a_page_keeps_to_its_goals(page: measure.Page) -> None:
    caps = CAPS.get(page.name, {})
    worse = {name: value for name, value in measure.missed(page).items() if value > caps.get(name, -1)}
    assert worse == {}, f"python -m tests.docs.measure {page.name} shows the places; capped at {caps}"


def test_all_pages_together_keep_to_their_goals() -> None:
    goals = {
        "words": measure.ALL_WORDS,
        "results": measure.RESULTS_WORDS,
        "mean": measure.MEAN,
        "long": measure.LONG_FRACTION,
        "longest": 0,
    }
    reached = measure.totals(MEASURED)
    worse = {name: value for name, value in reached.items() if value > max(goals[name], CAPS["all"][name])}
    assert worse == {}


def test_sentences_words_and_cells_are_told_apart() -> None:
    text = (
        "# Run a thing\n\nOne two `a b c` four. It costs 0.5 s, eq. Here ends it!\nStill [linked](x.md) here\n\n"
        "- an item\n- Whether it runs, is told by nobody.\n\n    code is none.\n\n| a | b c |\n|---|---|\n\n"
        "```{code-block} console\n$ output is no word\n```\n"
    )
    page = measure.measure_text(measure.ROOT / "docs" / "howto" / "page.md", text)
    assert page.title == "Run a thing"
    assert page.sentences == [
        "One two `a b c` four.",
        "It costs 0.5 s, eq. Here ends it!",
        "Still linked here",
        "an item",
        "Whether it runs, is told by nobody.",
    ]
    assert page.lengths == [4, 8, 3, 2, 7]
    assert page.cells == ["a", "b c"]
    assert page.phrases == ["Whether it runs, is told by nobody."]
    assert page.words == len(text.partition("```")[0].replace("| ", " ").replace(" |", " ").split())
    assert measure.missed(page) == {"phrases": 1}


@pytest.mark.parametrize(
    ("text", "miss"),
    [
        ("# Run\n\n" + "word " * 41, {"mean", "longest"}),
        ("# Run\n\n" + "A word. " * 300, {"words"}),
        ("# Arms\n\nShort.", {"title"}),
        ("# Run\n\n| " + "word " * 13 + "|\n", {"cells"}),
        ("# Run\n\n" + ("word " * 26 + "end. ").capitalize() * 2 + "A word. " * 8, {"long"}),
    ],
)
def test_each_goal_can_be_missed(text: str, miss: set[str]) -> None:
    assert set(measure.missed(measure.measure_text(measure.ROOT / "docs" / "howto" / "page.md", text))) == miss
