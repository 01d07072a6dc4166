"""Measures of README and pages: ``python -m tests.docs.measure [PAGE]...`` prints them, one row a page.

Definitions. *Words* are those of ``wc -w``, with tables (their bars are no words) and examples, but without output that
commands made (blocks ``{code-block} console``) and without other directives. *Sentences* are those of paragraphs and
list items: one ends at ``.``, ``!``, ``?`` before a blank and a new beginning, or with its block; headings, tables,
code and quoted output are none. A span between backticks counts as one word. Table *cells* are the cells of a row,
their words counted alike.
With a PAGE the program also prints what to change: the sentences, cells, phrases and names that miss the goal.
"""

from __future__ import annotations

import json
import re
import sys
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
LONG, LONGEST, CELL = 25, 40, 12
"""Words of a long sentence, of the longest, and of the longest cell of a table."""
MEAN, LONG_FRACTION = 15.0, 0.1
"""Of all pages together; a page alone may have ``PAGE_MEAN`` and ``PAGE_LONG``, as short pages have few sentences."""
PAGE_MEAN, PAGE_LONG = 16.0, 0.15
WORDS = {"README.md": 650, "docs/tutorials": 800, "docs/howto": 500, "docs/plugins": 500, "docs/explanation": 1000}
ALL_WORDS, RESULTS_WORDS = 20_000, 6_000
CAPS = Path(__file__).with_name("caps.json")
"""Pages that miss a goal, with what they may reach; ``python -m tests.docs.measure --caps`` writes it anew."""
VERBS = re.compile(
    r"(?:Add|Aim|Answer|Bring|Build|Calibrate|Capture|Catch|Change|Check|Choose|Combine|Compare|"
    r"Connect|Control|Cross-check|Describe|Detect|Export|Extend|Find|Fit|Fix|Follow|Give|Hold|"
    r"Import|Install|Keep|Learn|Let|Locate|Log|Look|Make|Measure|Move|Observe|Place|Play|"
    r"Plug|Predict|Prepare|Protect|Push|Read|Record|Rehearse|Repair|Replay|Run|Search|See|Set|Share|"
    r"Show|Simulate|Solve|Start|Store|Take|Teach|Test|Track|Train|Try|Tune|Understand|Use|"
    r"Verify|Watch|Write)\b"
)
"""Verbs that open the title of a how-to page."""
PHRASES = (
    *("seen catch", "to proof", "null model", "handed over", "what came of", "all the same", "is told", "goes on"),
    *("are told", "in the worlds", "went back"),
)
CLAUSES = ("What", "Whether", "Which", "Those", "Of")
"""First words of a sentence that hide its subject; a question may open with them."""
_FENCE = re.compile(r"^(`{3,}|~{3,})([^\n]*)\n(.*?)^\1`*[ ]*$", re.M | re.S)
_COMMENT = re.compile(r"<!--.*?-->", re.S)
_LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
_ITEM = re.compile(r"^\s*(?:[-*+]|\d+[.)])\s+")
_END = re.compile(r"(?<=[.!?])[\"')*_]*\s+(?=[\"'(*_`\[]*[A-Z0-9§])")
_SHORT = re.compile(r"\b(e\.g|i\.e|eq|Eq|vs|cf|al|Fig|fig|Sec|approx|no|No|pp|p)\.\s")


@dataclass
class Page:
    """Measures of one page."""

    path: Path
    title: str = ""
    words: int = 0
    sentences: list[str] = field(default_factory=list)
    cells: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        return self.path.relative_to(ROOT).as_posix()

    @property
    def lengths(self) -> list[int]:
        return [count(sentence) for sentence in self.sentences]

    @property
    def mean(self) -> float:
        return sum(self.lengths) / max(len(self.lengths), 1)

    @property
    def long(self) -> float:
        """Fraction of sentences of more than ``LONG`` words."""
        return sum(length > LONG for length in self.lengths) / max(len(self.lengths), 1)

    @property
    def too_long(self) -> list[str]:
        return [sentence for sentence in self.sentences if count(sentence) > LONGEST]

    @property
    def full_cells(self) -> list[str]:
        return [cell for cell in self.cells if count(cell) > CELL]

    @property
    def phrases(self) -> list[str]:
        """Sentences and cells with a banned phrase or first word."""
        hidden = [one for one in self.sentences if one.split()[0] in CLAUSES and not one.endswith("?")]
        text = [*self.sentences, *self.cells]
        banned = [one for one in text if any(re.search(rf"\b{phrase}\b", one, re.I) for phrase in PHRASES)]
        return list(dict.fromkeys([*banned, *hidden]))


def count(text: str) -> int:
    """Return the number of words of plain text; a span between backticks is one."""
    return len([word for word in re.sub(r"`[^`]+`", "code", text).split() if re.search(r"\w", word)])


def measure(path: Path) -> Page:
    """Return the measures of the page at ``path``."""
    return measure_text(path, path.read_text())


def measure_text(path: Path, text: str) -> Page:
    """Return the measures of ``text``, as those of the page at ``path``."""
    page = Page(path)
    text = _COMMENT.sub("", text)
    made = _FENCE.sub(lambda block: "" if block[2].startswith("{") else block[3], text)
    page.words = len([word for word in made.split() if word != "|"])
    blocks = [""]
    for line in _LINK.sub(r"\1", _FENCE.sub("", text)).splitlines():
        if line.startswith("#"):
            page.title = page.title or line.strip("# ")
            blocks.append("")
        elif line.lstrip().startswith("|"):
            cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip().strip("|"))]
            page.cells += [cell for cell in cells if re.search(r"\w", cell)]
            blocks.append("")
        elif not line.strip() or (re.match(r"^(?: {4}|\t)", line) and not blocks[-1]):
            blocks.append("")
        elif _ITEM.match(line):
            blocks.append(_ITEM.sub("", line))
        else:
            blocks[-1] += f" {line.strip()}"
    page.sentences = [one for block in blocks for one in sentences(block)]
    return page


def sentences(block: str) -> list[str]:
    """Return the sentences of a paragraph."""
    kept = _SHORT.sub(lambda found: found[0].replace(" ", "\0"), " ".join(block.split()))
    return [one.strip().replace("\0", " ") for one in _END.split(kept) if re.search(r"\w", one)]


def pages() -> list[Path]:
    """Return README and the pages of docs."""
    return [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]


GOALS = {"words": 10**9, "mean": PAGE_MEAN, "long": PAGE_LONG, "longest": 0, "cells": 0, "phrases": 0, "title": 0}
"""What a page is held to; ``words`` of a folder stand in ``WORDS``, ``long`` may be one sentence in any case."""


def reached(page: Page) -> dict[str, float]:
    """Return the measures of a page by the names of ``GOALS``."""
    guide = page.name.startswith(("docs/howto/", "docs/plugins/"))
    return {
        "words": page.words,
        "mean": round(page.mean, 1),
        "long": round(page.long, 2),
        "longest": len(page.too_long),
        "cells": len(page.full_cells),
        "phrases": len(page.phrases),
        "title": int(guide and not VERBS.match(page.title)),
    }


def missed(page: Page) -> dict[str, float]:
    """Return the measures in which a page misses its goal."""
    goals = {**GOALS, "words": WORDS.get(page.name, WORDS.get(page.path.parent.relative_to(ROOT).as_posix(), 10**9))}
    few = sum(length > LONG for length in page.lengths) <= 1
    return {
        name: value for name, value in reached(page).items() if value > goals[name] and not (name == "long" and few)
    }


def totals(measured: list[Page]) -> dict[str, float]:
    """Return the measures over all pages."""
    lengths = [length for page in measured for length in page.lengths]
    results = sum(page.words for page in measured if page.name.startswith("docs/results/"))
    return {
        "words": sum(page.words for page in measured) - results,
        "results": results,
        "mean": round(sum(lengths) / len(lengths), 1),
        "long": round(sum(length > LONG for length in lengths) / len(lengths), 3),
        "longest": sum(length > LONGEST for length in lengths),
    }


def main(arguments: list[str]) -> None:
    """Print the table of the pages, or of those asked for with their sentences; ``--caps`` stores what is missed."""
    measured = [measure(path) for path in pages()]
    if arguments == ["--caps"]:
        caps = {page.name: found for page in measured if (found := missed(page))}
        CAPS.write_text(json.dumps({"all": totals(measured), **caps}, indent=0) + "\n")
        return
    asked = [page for page in measured if not arguments or any(page.name.endswith(one) for one in arguments)]
    print(f"{'page':44}" + "".join(f"{name:>9}" for name in GOALS))
    for page in asked:
        print(f"{page.name:44}" + "".join(f"{value:9g}" for value in reached(page).values()), *missed(page))
    print("all pages:", ", ".join(f"{name} {value:g}" for name, value in totals(measured).items()))
    for page in asked if arguments else []:
        long = [sentence for sentence in page.sentences if count(sentence) > LONG]
        for kind, found in (("long", long), ("cell", page.full_cells), ("phrase", page.phrases)):
            for text in found:
                print(f"{page.name}: {kind} ({count(text)}): {text}")


if __name__ == "__main__":
    main(sys.argv[1:])
