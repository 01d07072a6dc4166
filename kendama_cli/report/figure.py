"""A numbered figure of the page: panels with letters, and the caption that says what is seen."""

from __future__ import annotations

import html
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from kendama_cli.report.receiver import receiving

LETTERS = "abcdefgh"


@cache
def save_script() -> str:
    """Return a script with a button under each figure that saves it as SVG; the page's policy must allow it."""
    text = files("kendama_cli.report").joinpath("save.js").read_text(encoding="utf-8")
    return f"'use strict';\n(() => {{\n{text}}})();\n"


@dataclass(frozen=True)
class Panel:
    """One part of a figure: a short title and its inline SVG or HTML; ``name`` is that of its drawing."""

    title: str
    body: str
    name: str = ""


@dataclass(frozen=True)
class Figure:
    """Panels in ``columns`` columns (their width stays where fewer are there) under one caption (plain text)."""

    caption: str
    panels: tuple[Panel, ...]
    columns: int = 2
    sentences: tuple[str, ...] = ()
    """Sentences of the caption, those of one panel begin with its letter: ``(a) ``."""

    def panel_captions(self) -> dict[str, str]:
        """Return the caption of each drawn panel that stands alone, by the drawing's name."""
        marks = [f"({letter}) " for letter in LETTERS]
        shared = [one for one in self.sentences if not one.startswith(tuple(marks))]
        found = {}
        for mark, panel in zip(marks, self.panels, strict=False):
            own = [one.removeprefix(mark) for one in self.sentences if one.startswith(mark)]
            if panel.name:
                told = " ".join(own + shared) if self.sentences else self.caption
                found[panel.name] = told if told.lower().startswith(panel.title.lower()) else f"{panel.title}. {told}"
        return found

    def html(self, number: int, meanings: Mapping[str, str] | None = None) -> str:
        """Return the figure as HTML, with its number, and the meaning of each panel's drawing by its name."""
        if (receiver := receiving()) is not None:
            receiver.captions(self.panel_captions())
        one = len(self.panels) == 1
        parts = []
        for letter, panel in zip(LETTERS, self.panels, strict=False):
            mark = "" if one else f"<b>{letter}</b>"
            shown = "".join(
                f'<details class="meaning"><summary>What is this?</summary><p>{html.escape(words)}</p></details>'
                for name, words in (meanings or {}).items()
                if f'id="{name}-' in panel.body
            )
            parts.append(f'<div class="panel"><h3>{mark}{html.escape(panel.title)}</h3>{panel.body}{shown}</div>')
        return (
            f'<figure id="figure-{number}"><div class="panels cols-{self.columns}">{"".join(parts)}</div>'
            f"<figcaption><b>Figure {number}.</b> {html.escape(self.caption)}</figcaption></figure>"
        )


def figure(caption: list[str], panels: list[Panel | None], columns: int = 2) -> list[Figure]:
    """Return a figure of the panels that could be drawn, with the caption's sentences; none where none could."""
    drawn = tuple(panel for panel in panels if panel is not None)
    sentences = tuple(sentence for sentence in caption if sentence)
    return [Figure(" ".join(sentences), drawn, columns, sentences)] if drawn else []


def lettered(panels: list[Panel | None], sentences: list[str]) -> list[str]:
    """Return the sentence of each panel that could be drawn, after its letter."""
    drawn = [text for panel, text in zip(panels, sentences, strict=True) if panel is not None]
    if len(drawn) == 1:
        return drawn
    return [f"({letter}) {text}" for letter, text in zip(LETTERS, drawn, strict=False)]
