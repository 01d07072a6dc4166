"""Every command line that README and docs show is one: its options are there, and its groups and keys compose."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from kendama_cli.cli import sweep_work
from kendama_cli.cli.app import app
from kendama_cli.config.compose import composed
from kendama_cli.config.site import find_site
from kendama_cli.errors import ConfigError, UsageError
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.pipeline.where import with_executor
from tests.docs import output

ROOT = Path(__file__).resolve().parents[2]
# these pages show parts of examples/bench, agents and springs, which are not installed here; tests/plugin runs them
FILES = {
    "setup.yaml": "{}\n",
    "conf/capture/take.yaml": "kind: file\npath: take.csv\n",
    "conf/capture/swing.yaml": "kind: file\npath: take.csv\n",
    "conf/hardware/mine.yaml": "kind: twin\n",
    "conf/robot/mine.yaml": "defaults: [urdf]\npath: my_arm.urdf\n",
    "conf/safety/lab.yaml": "defaults: [default]\n",
}
"""Files that the pages let a laboratory write."""
OF_A_PACKAGE = re.compile(r"add-a-|bring-an-agent|write-a-package|interact-controller")
PAGES = [
    ROOT / "README.md",
    *sorted(path for path in (ROOT / "docs").rglob("*.md") if not OF_A_PACKAGE.match(path.name)),
]
SYNOPSIS = re.compile(r"\[-|OVERRIDE| \| |\.\.\.|  ")  # options left out, or the columns of a list

REDIRECTED = re.compile(r" \d?> ?\S+$")


def lines_of(text: str) -> list[str]:
    """The command lines on a page: those of its code blocks, and those between backticks."""
    blocks = list(re.findall(r"^```(?:sh)?\n(.*?)^```", text, re.M | re.S))
    blocks += re.findall(r"^(?: {4}.*\n)+", text, re.M)
    blocks += ["\n".join(output.commands(found["body"])) for found in output.BLOCK.finditer(text)]
    code = [re.sub(r" #.*| 2?> \S+$", "", line).strip() for block in blocks for line in block.splitlines()]
    code += [" ".join(line.split()) for line in re.findall(r"`(kendama [^`]+)`", text)]
    found = [part.strip(" &") for line in code for part in line.split("&&")]
    return [line for line in found if line.startswith("kendama ") and not SYNOPSIS.search(line)]


SHOWN = sorted({(page.name, line) for page in PAGES for line in lines_of(page.read_text())})


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_no_command_line_has_slipped_out_of_its_block(page: Path) -> None:
    outside = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S)
    assert re.findall(r"^(?:kendama|pip|python) .*", outside, re.M) == []


def parsed(words: list[str]) -> tuple[str, dict[str, Any]]:
    """The command that ``words`` name, and its parameters; raises what typer raises for what it does not take."""
    command: Any = get_command(app)
    names = []
    while hasattr(command, "commands") and words and not words[0].startswith("-"):
        names.append(words[0])
        command = command.get_command(None, words[0])
        assert command is not None, words[0]
        words = words[1:]
    if not words or words == ["--help"]:
        return " ".join(names), {}  # a name alone, as in a sentence
    return " ".join(names), command.make_context(names[-1], words).params if names else {}


def asked(line: str) -> list[tuple[str, ...]]:
    """The overrides of ``line``, of the first and the last run where it is a sweep; raises where it is no command."""
    name, given = parsed(shlex.split(REDIRECTED.sub("", line))[1:])
    site = find_site()
    pipeline = load_pipeline(given.get("pipeline") or "kendama", site.pipeline_folders).until(given.get("until"))
    overrides = with_executor(given.get("overrides") or [], given.get("on"))
    if name == "config":  # keys and groups to print, between overrides
        overrides = [word for word in overrides if "=" in word]
    combinations = sweep_work.expand_sweep(site, overrides) if name == "sweep" else [overrides]
    return [(*pipeline.overrides, *texts) for texts in (combinations[0], combinations[-1])]


def compose(overrides: Iterable[str]) -> None:
    """Raise where these do not compose in the folder that they are typed in."""
    build_settings(composed(find_site(), list(overrides)))


def check(line: str) -> None:
    """Raise where ``line`` is no command, or its overrides do not compose."""
    for overrides in asked(line):
        compose(overrides)


def together(lines: Iterable[str]) -> list[dict[str, tuple[str, ...]]]:
    """Overrides of lines, by node: those that ask for nothing else of the same node share a composition."""
    made: list[dict[str, tuple[str, ...]]] = []
    for overrides in dict.fromkeys(one for line in lines for one in asked(line)):
        nodes: dict[str, tuple[str, ...]] = {}
        for text in overrides:
            node = re.split(r"[./=@]", text.lstrip("+~"))[0]
            nodes[node] = (*nodes.get(node, ()), text)
        fits = (one for one in made if all(one.get(node, texts) == texts for node, texts in nodes.items()))
        if (first := next(fits, None)) is None:
            made.append(first := {})
        first.update(nodes)
    return made


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with files of its own; one for all: most lines ask for compositions that others asked for before."""
    folder = tmp_path_factory.mktemp("laboratory")
    for name, text in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


@pytest.fixture(autouse=True)
def typed_here(laboratory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands are typed in the laboratory."""
    monkeypatch.chdir(laboratory)


def test_the_pages_show_many_commands() -> None:
    assert len(SHOWN) > 35
    commands = {line.split()[1] for _, line in SHOWN}
    assert commands >= {"run", "plan", "sweep", "report", "camera", "motion", "robot", "log"}


@pytest.mark.parametrize(("page", "line"), SHOWN, ids=[f"{page}: {line}" for page, line in SHOWN])
def test_a_command_of_the_docs_is_one(page: str, line: str) -> None:
    assert asked(line)


def test_what_the_docs_ask_for_composes() -> None:
    for nodes in together(line for _, line in SHOWN):
        compose(text for texts in nodes.values() for text in texts)


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("kendama run --frobnicate", "No such option"),
        ("kendama run robot=iiwo", "'robot' is 'iiwo'"),
        ("kendama sweep learn.alfa=0.1,0.2", "unknown key 'learn.alfa'"),
        ("kendama run learn.alpha=0.1,0.2", "learn.alpha"),
        ("kendama run -p imitate", "imitate"),
        ("kendama sweep --until lern seed=1,2", "lern"),
    ],
)
def test_the_check_notices_what_is_no_command(line: str, error: str) -> None:
    with pytest.raises(Exception, match=re.escape(error)) as raised:
        check(line)
    assert isinstance(raised.value, ConfigError | UsageError) or "Option" in type(raised.value).__name__
