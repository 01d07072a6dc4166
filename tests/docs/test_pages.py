"""Lists in README and docs agree with the declarations."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from kendama_cli.schema.declaration import find_stage, stage_names

ROOT = Path(__file__).resolve().parents[2]
BUILT_IN = [name for name in stage_names() if (ROOT / "kendama_cli" / "stages" / name).is_dir()]


def test_the_page_of_a_part_has_every_topic_of_its_stages() -> None:
    of_parts = {name: part for name in stage_names() if (part := part_of(name)) is not None}
    assert "interact" in of_parts
    for part in set(of_parts.values()):
        topics = {
            topic for name, one in of_parts.items() if one == part for topic in getattr(find_stage(name), "topics", {})
        }
        assert listed(f"plugins/{part}.md") == topics


def part_of(stage: str) -> str | None:
    """Return the part of ours that brings a stage; None for one of the core or of others."""
    declaration = find_stage(stage)
    run = "" if declaration is None else declaration.run
    return run.split(".")[2] if run.startswith("kendama_cli.plugins.") else None


def listed(page: str) -> set[str]:
    """Return the topics in the tables of a page."""
    rows = re.findall(r"^\| (`/[^|]*) \|", (ROOT / "docs" / page).read_text(), re.M)
    return {topic for row in rows for topic in re.findall(r"`([^`]+)`", row)}


def test_the_navigation_names_every_page_once() -> None:
    trees = re.findall(
        r"^```\{toctree\}\n(?::[^\n]*\n)*\n(.*?)^```", (ROOT / "docs" / "index.md").read_text(), re.M | re.S
    )
    named = [f"{name}.md" for tree in trees for name in tree.split()]
    there = {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")} - {"index.md"}
    assert sorted(named) == sorted(there)


@pytest.mark.parametrize(
    "page", sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]), ids=lambda path: path.name
)
def test_no_link_between_pages_leads_nowhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text()):
        if "://" not in target:
            assert (page.parent / target).exists(), target
