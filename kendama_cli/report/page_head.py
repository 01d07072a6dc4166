"""The head of a page: its style, and a policy that lets nothing but the page's own scripts run."""

from __future__ import annotations

import base64
import hashlib
import html
import json
from typing import Any

from kendama_cli.report.style import CSS


def data_script(value: Any) -> str:
    """Return ``value`` as an element that holds JSON for the page's scripts, and that nothing in it can end."""
    text = json.dumps(value, separators=(",", ":")).replace("<", "\\u003c")
    return f'<script type="application/json">{text}</script>'


def page_head(title: str, *scripts: str, also: str = "") -> str:
    """Return the beginning of a page up to its body; of all scripts that may ever stand in it only ``scripts`` run.

    ``also`` is what else its policy allows.

    Titles, labels and text of a log are escaped where they are written. Should one not be, the browser still loads
    nothing and runs nothing of it.
    """
    own = " ".join(f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'" for text in scripts)
    policy = (
        f"default-src 'none'; {f'script-src {own}; ' if own else ''}style-src 'unsafe-inline'; "
        f"img-src data:; media-src data:; base-uri 'none'; form-action 'none'{f'; {also}' if also else ''}"
    )
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        '<meta name="viewport" content="width=device-width,initial-scale=1"><link rel="icon" href="data:,">'
        f"<title>{html.escape(title)}</title>\n<style>{CSS}</style></head>\n"
    )
