"""Every setting, file, metric, topic, option and identifier between backticks on a page exists."""

from __future__ import annotations

import dataclasses
import functools
import re
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from kendama_cli.cli.app import app
from kendama_cli.pipeline.nodes import node_schemas
from kendama_cli.schema.settings import variants
from tests.docs import measure

ROOT = measure.ROOT
SOURCES = ("kendama_cli", "conf", "pipelines", "examples", "tests", "data", ".ci", "docs/conf.py", "docs/declared.py")
TEXT = {".py", ".yaml", ".toml", ".js", ".html", ".hpp", ".cpp", ".sh", ".csv", ".json", ".sub", ""}
FOLDERS = ("conf", "pipelines", "data", "docs", "examples", "kendama_cli", "tests", ".ci", ".github")
OF_OTHERS = {"--no-build-isolation", "--system-site-packages", "--privileged", "--network", "ee_link", "my_learner"}
"""Names of other programs, and what a reader makes."""
NOT_OURS = re.compile(
    r"[A-Z]{3,}|[<>{}$…]|^kendama |^pip |^python |\.\.\.|^beyond_\w+$|^conf/.*(?:mine|lab|bench)\.yaml$"
)
"""Placeholders, command lines (``test_commands`` has them), metrics whose names code composes, files of a reader."""
KEY = re.compile(r"[a-z]\w*(?:\.\w+)+")


def spans(text: str) -> Iterator[str]:
    """Yield the spans between backticks, outside blocks of code and comments."""
    prose = re.sub(r"^```.*?^```|<!--.*?-->", "", text, flags=re.M | re.S)
    prose = re.sub(r"(?:\A|\n\n)(?: {4}.*\n)+", "\n", prose)
    yield from re.findall(r"(?<!`)`([^`\n]+)`(?!`)", prose)


@functools.cache
def words() -> frozenset[str]:
    """Return every identifier in sources, configuration, examples and tests."""
    files = [path for name in SOURCES for path in ([ROOT / name] if "." in name[1:] else (ROOT / name).rglob("*"))]
    files = [path for path in files if path.is_file() and path.suffix in TEXT and "docs" not in path.parts[-2:]]
    texts = [path.read_text(errors="replace") for path in files]
    return frozenset(word for text in texts for word in re.findall(r"[A-Za-z_]\w*", text))


@functools.cache
def keys() -> frozenset[str]:
    """Return every dotted key of the settings, and its groups."""
    schemas, error = node_schemas()
    assert error is None
    waiting: list[tuple[str, Any]] = list(schemas.items())
    found = set()
    while waiting:
        key, schema = waiting.pop()
        found.add(key)
        inner = schema if dataclasses.is_dataclass(schema) else next(iter(typing.get_args(schema)), None)
        kinds = variants(schema) or ({"": inner} if dataclasses.is_dataclass(inner) else {})
        for kind in kinds.values():
            hints = typing.get_type_hints(kind, include_extras=True)
            waiting += [(f"{key}.{field.name}", hints[field.name]) for field in dataclasses.fields(kind)]
    return frozenset(found)


@functools.cache
def options() -> frozenset[str]:
    """Return the options of all commands and scripts."""
    files = [path for name in ("kendama_cli", "examples", "tests/films") for path in (ROOT / name).rglob("*.py")]
    found = {word for path in files for word in re.findall(r"--[a-z][\w-]*", path.read_text())}
    waiting: list[Any] = [get_command(app)]
    while waiting:
        command = waiting.pop()
        names = command.list_commands(None) if hasattr(command, "commands") else []
        waiting += [command.get_command(None, name) for name in names]
        for option in command.params:
            found |= {*option.opts, *option.secondary_opts}
    return frozenset(found)


def problem(span: str, page: Path) -> str:
    """Return what does not exist of ``span``, nothing where all of it does or it is none of our names."""
    if span in OF_OTHERS or NOT_OURS.search(span):
        return ""
    text, _, value = span.partition("=")
    found: set[str] = set()
    if span.startswith("--"):
        found = {word.partition("=")[0] for word in span.split() if word.startswith("--")} - options() - OF_OTHERS
    elif re.fullmatch(r"[\w.-]+(?:/[\w.*-]+)*/?", text) and text.split("/")[0] in FOLDERS and "/" in text:
        found = set() if any(list(place.glob(text.rstrip("/"))) for place in (ROOT, page.parent)) else {text}
    elif KEY.fullmatch(text):
        ours = text.split(".")[0] in {key.split(".")[0] for key in keys()}
        found = {text} - keys() if ours else set()
    elif "/" in text and re.fullmatch(r"[\w/.]+=[\w,]+", span):
        found = {f"{text}={one}" for one in value.split(",") if not choice_exists(text.replace(".", "/"), one)}
    elif re.fullmatch(r"[a-z]\w*_\w+", text):
        found = {text} - words()
    return ", ".join(sorted(found))


def choice_exists(group: str, choice: str) -> bool:
    """Return True if ``conf/`` of the core or of a part has the choice."""
    return any(any(ROOT.glob(f"{place}conf/{group}/{choice}.yaml")) for place in ("", "kendama_cli/plugins/*/"))


@pytest.mark.parametrize("page", measure.pages(), ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_name_between_backticks_exists(page: Path) -> None:
    missing = {span: found for span in spans(page.read_text()) if (found := problem(span, page))}
    assert missing == {}


@pytest.mark.parametrize(
    "span",
    [
        "learn.count.limit",
        "learn.count.limit=30",
        "conf/task/hard.yaml",
        "--frobnicate",
        "rolouts_to_solved",
        "learn/task=harder",
    ],
)
def test_a_name_that_does_not_exist_is_noticed(span: str) -> None:
    assert problem(span, ROOT / "README.md") != ""


@pytest.mark.parametrize(
    "span", ["learn.alpha", "learn.alpha=0.3", "conf/learn/task/", "--watch", "rollouts_to_solved", "learn/task=hard"]
)
def test_a_name_that_exists_is_none(span: str) -> None:
    assert problem(span, ROOT / "README.md") == ""
