"""Tables and figures as LaTeX that compiles with booktabs and graphicx."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Sequence
from typing import Any

from kendama_cli.report.tables import number

_LATEX = {
    **{one: f"\\{one}" for one in "&%$#_{}"},
    "\\": r"\textbackslash{}",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "<": "$<$",
    ">": "$>$",
    "|": "$|$",
    "\n": " ",
    "\r": " ",
    "−": "$-$",
    "–": "--",
    "—": "---",
    "…": r"\ldots{}",
    "’": "'",
    "‘": "`",
    "“": "``",
    "”": "''",
    "°": r"$^\circ$",
    "²": "$^2$",
    "³": "$^3$",
    "±": r"$\pm$",
    "×": r"$\times$",
    "·": r"$\cdot$",
    "→": r"$\to$",
    "≤": r"$\leq$",
    "≥": r"$\geq$",
    "¼": "1/4",
    "µ": r"$\mu$",
    "\N{NO-BREAK SPACE}": "~",
    "α": r"$\alpha$",
    "β": r"$\beta$",
    "γ": r"$\gamma$",
    "ε": r"$\varepsilon$",
    "λ": r"$\lambda$",
    "σ": r"$\sigma$",
    "τ": r"$\tau$",
}


def escaped(text: str) -> str:
    """Return plain text as LaTeX of plain ASCII; a sign that has no command stands without its accent, or as ``?``."""
    return "".join(_LATEX.get(one) or _plain(one) for one in text)


def _plain(sign: str) -> str:
    if sign.isascii():
        return sign
    return unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode() or "?"


def latex_table(name: str, title: str, head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return a floating table; it names the setting or metric in its first column."""
    lines = [" & ".join(escaped(number(cell)) for cell in row) + r" \\" for row in (head, *rows)]
    body = [rf"\begin{{tabular}}{{l{'r' * (len(head) - 1)}}}", r"\toprule", lines[0], r"\midrule", *lines[1:]]
    return _float(
        "table", [rf"\caption{{{escaped(title)}}}\label{{tab:{name}}}", *body, r"\bottomrule", r"\end{tabular}"]
    )


def latex_figure(name: str, caption: str) -> str:
    """Return a floating figure that includes ``name``.pdf in the width that it was drawn in."""
    shown = [rf"\includegraphics{{{name}.pdf}}", rf"\caption{{{escaped(caption)}}}\label{{fig:{name}}}"]
    return _float("figure", shown)


def latex_document(title: str, names: Iterable[str]) -> str:
    """Return a document that inputs the files ``names``.tex, to look at them all."""
    head = [r"\documentclass{article}", r"\usepackage{booktabs,graphicx}"]
    head += [
        r"\usepackage[margin=14mm]{geometry}",
        rf"\title{{{escaped(title)}}}\date{{}}",
        r"\begin{document}\maketitle",
    ]
    return "\n".join([*head, *(rf"\input{{{name}.tex}}\clearpage" for name in names), r"\end{document}", ""])


def _float(kind: str, lines: Sequence[str]) -> str:
    return "\n".join([rf"\begin{{{kind}}}[htbp]", r"\centering", *lines, rf"\end{{{kind}}}", ""])
