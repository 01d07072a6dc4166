"""The pages as a site: what is declared is listed, and every link and picture is there."""

from __future__ import annotations

import functools
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest
from typer.main import get_command

from kendama_cli.cli.app import app
from kendama_cli.config.compose import composed
from kendama_cli.pipeline.catalogue import pipeline_names
from kendama_cli.plugins.help import docs
from kendama_cli.schema.declaration import find_stage, stage_names

ROOT = Path(__file__).resolve().parents[3]
COMMAND = [sys.executable, "-m", "kendama_cli.cli.main", "docs", "--no-show"]


@pytest.fixture(scope="module")
def declared() -> Any:
    """The extension; values are those of the default configuration, as each of 45 variants takes a composition."""
    spec = importlib.util.spec_from_file_location("declared", ROOT / "docs" / "declared.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    defaults = functools.cache(lambda site: composed(site, []))
    module.composed = lambda site, overrides: defaults(site)  # type: ignore[attr-defined]
    return module


def test_the_reference_lists_every_stage_metric_topic_and_setting(declared: Any) -> None:
    text, topics = declared.stages(), declared.topics()
    for name in stage_names():
        stage = find_stage(name)
        assert stage is not None
        assert f"## Stage {name}\n" in text
        for one in (*stage.topics, *stage.metrics, *stage.figures):
            assert f"| `{one}` |" in text, one
        assert {headline.metric for headline in stage.headline} <= set(stage.metrics)
        assert all(re.search(rf"^\| `{re.escape(topic)}` \| [\w.]+ \| \w", topics, re.M) for topic in stage.topics)
    # one value of a nested group, one of a variant that is not the default, one of a list's items
    assert "| `learn.goal.slack_s` | `0.01` |" in text
    assert "| `capture.marker_to_cup_m` |" in text
    assert "| `interact.script[].duration_s` |" in text
    assert "| `hardware.imperfection.rope_scale` |" in declared.nodes()


def test_every_command_has_its_help_on_the_page_of_commands(declared: Any) -> None:
    page = (ROOT / "docs" / "reference" / "commands.md").read_text()
    asked = re.findall(r"^## kendama ([\w-]+)\n\n<!-- declared: help ([\w-]+) -->$", page, re.M)
    command: Any = get_command(app)
    assert sorted(asked) == sorted((name, name) for name in command.list_commands(None))
    assert "  -h, --help  Show this message and exit.\n" in declared.help_of("cache")
    assert "### kendama cache gc\n\n```text\n$ kendama cache gc --help\nUsage: kendama cache gc" in declared.help_of(
        "cache"
    )
    assert max(map(len, declared.help_of("run").splitlines())) <= 80


def test_the_overview_has_every_stage_and_every_pipeline(declared: Any) -> None:
    for name in stage_names():
        assert f"| [`{name}`](settings.md#stage-{name}) |" in declared.overview()
    for name in pipeline_names([ROOT / "pipelines"]):
        assert f"`{name}`" in declared.pipelines()


def test_the_choices_of_a_group_are_its_files(declared: Any) -> None:
    rows = re.findall(r"^\| `(\w+)` \| \w.{15,} \|$", declared.choices("learn/learner"), re.M)
    assert rows == sorted(path.stem for path in (ROOT / "conf" / "learn" / "learner").glob("*.yaml"))
    twins = re.findall(r"^\| `(\w+)` \|", declared.choices("hardware twin_*"), re.M)
    assert twins == sorted(path.stem for path in (ROOT / "conf" / "hardware").glob("twin_*.yaml"))


def test_without_sphinx_one_line_says_what_to_install(tmp_path: Path) -> None:
    (tmp_path / "furo.py").write_text("raise ModuleNotFoundError(\"No module named 'furo'\", name='furo')\n")
    hidden = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(COMMAND, cwd=tmp_path, env=hidden, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "needs furo: pip install '.[docs]'" in done.stderr


def test_a_release_opens_the_site_that_it_has(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = tmp_path / "bundled" / "docs" / "site" / "index.html"
    first.parent.mkdir(parents=True)
    first.write_text("<p>pages</p>")
    opened: list[str] = []
    monkeypatch.setattr(docs, "bundled_root", lambda: tmp_path / "bundled")
    monkeypatch.setattr(docs, "_built", lambda *_: pytest.fail("built"))
    monkeypatch.setattr(docs.webbrowser, "open", opened.append)
    docs.docs(None, show=True, home=None)
    assert opened == [first.as_uri()]


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_site_is_built_without_a_warning_and_no_link_leads_nowhere(tmp_path: Path) -> None:
    done = subprocess.run([*COMMAND, "-o", "site"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    said = done.stderr.splitlines()
    assert said[:1] == ["building the site: about a minute the first time"]
    assert re.fullmatch(r"built in \d+ s", said[-1])
    assert len(said) == 2, done.stderr
    site = tmp_path / "site"
    pages = {path.resolve(): path.read_text() for path in site.rglob("*.html") if "_static" not in path.parts}
    assert len(pages) > 25
    anchors = {path: set(re.findall(r'\bid="([^"]+)"', text)) for path, text in pages.items()}
    for path, text in pages.items():
        assert not re.findall(r'<(?:script|link|img)[^>]+(?:src|href)="(?:https?:)?//', text), path
        for target in re.findall(r'(?:href|src)="([^"]+)"', text):
            place, _, anchor = unquote(target.partition("?")[0]).partition("#")
            if "://" in place or place.startswith(("data:", "mailto:")):
                continue
            there = (path.parent / place).resolve() if place else path
            assert there.exists(), f"{path} links {target}"
            if anchor and there in anchors:
                assert anchor in anchors[there], f"{path} links {target}"
    assert sum(path.stat().st_size for path in site.rglob("*") if ".doctrees" not in path.parts) < 5e6
