"""A numbered figure of the page: panels with letters, and the caption that says what is seen."""

from __future__ import annotations

import html
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files


@cache
def save_script() -> str:
    """Return a script with a button under each figure that saves it as SVG; the page's policy must allow it."""
    text = files("kendama_cli.report").joinpath("save.js").read_text(encoding="utf-8")
    return f"'use strict';\n(() => {{\n{text}}})();\n"


@dataclass(frozen=True)
class Panel:
    """One part of a figure: a short title and its inline SVG or HTML."""

    title: str
    body: str


@dataclass(frozen=True)
class Figure:
    """Panels in ``columns`` columns (their width stays where fewer are there) under one caption (plain text)."""

    caption: str
    panels: tuple[Panel, ...]
    columns: int = 2

    def html(self, number: int, meanings: Mapping[str, str] | None = None) -> str:
        """Return the figure as HTML, with its number, and the meaning of each panel's drawing by its name."""
        one = len(self.panels) == 1
        parts = []
        for letter, panel in zip("abcdefgh", self.panels, strict=False):
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
    return [Figure(" ".join(sentence for sentence in caption if sentence), drawn, columns)] if drawn else []


def lettered(panels: list[Panel | None], sentences: list[str]) -> list[str]:
    """Return the sentence of each panel that could be drawn, after its letter."""
    drawn = [text for panel, text in zip(panels, sentences, strict=True) if panel is not None]
    if len(drawn) == 1:
        return drawn
    return [f"({letter}) {text}" for letter, text in zip("abcdefgh", drawn, strict=False)]
