"""The files that a page of the docs shows: each code block whose first line is a comment with its path."""

from __future__ import annotations

import re
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1] / "docs"
BLOCK = re.compile(r"^```(?:python|yaml|toml)\n# (\S+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def write_documented(page: str, folder: Path) -> list[str]:
    """Write the files that ``docs/PAGE`` shows below ``folder``; their paths."""
    found = BLOCK.findall((DOCS / page).read_text())
    for name, content in found:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    return [name for name, _ in found]


def declare_installed(folder: Path, name: str, groups: dict[str, str]) -> None:
    """Make the package ``name`` in ``folder`` look installed, with its entry points by group (LINE per entry point)."""
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = [line for group, entry in groups.items() for line in (f"[{group}]", entry)]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
