"""Every line that is documented or printed installs what it says, from a checkout."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from kendama_cli import __version__, errors

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
SHOWN = ("README.md", "CONTRIBUTING.md", "Dockerfile", ".ci", "docs", "examples", "conf", "kendama_cli")
TEXT = {"", ".md", ".py", ".toml", ".yaml", ".html"}
LINE = re.compile(r"\b(?:pip|pipx|uv tool|uv pip) install((?: +(?:'[^'`]+'|\"[^\"`]+\"|[^\s`'\"&;,)#]+))+)")
MY_LEARNER = ROOT / "examples" / "course" / "exercises" / "8-your-own-learner" / "my-learner"
OURS = {".": ("kendama-cli", ROOT), "my-learner": ("my-learner", MY_LEARNER)}
UV = (sys.executable, "-m", "uv", "pip")


def files(*names: str) -> list[Path]:
    """The text files below the root that are named, or lie in folders that are."""
    found = [
        path for name in names for path in ([ROOT / name] if (ROOT / name).is_file() else (ROOT / name).rglob("*"))
    ]
    return [path for path in found if path.is_file() and path.suffix in TEXT and "__pycache__" not in path.parts]


def shown_lines() -> dict[str, str]:
    """What pages, scripts and sources ask pip for, and a file that does; of extras also what the errors say."""
    lines: dict[str, str] = {}
    for path in files(*SHOWN):
        text = path.read_text()
        for extra in re.findall(r"install_line\(['\"](\w+)['\"]\)", text):
            text += "\n" + errors.install_line(extra).partition(" in ")[0]
        for asked in LINE.findall(text):
            if not re.search(r"[{*]| of ", asked):  # a name that is filled in, files, prose
                lines.setdefault(asked.strip(), str(path.relative_to(ROOT)))
    return lines


LINES = shown_lines()


def packages(line: str) -> list[str]:
    return [word for word in shlex.split(line) if not word.startswith("-")]


def test_no_text_asks_for_the_package_of_others_that_is_called_kendama() -> None:
    wrong = re.compile(
        r"kendama\[\w|install (?:-\S+ )*['\"]?kendama\b(?!-cli)|(distribution\(|dependencies = \[)\"kendama\""
    )
    texts = [path for path in files(*SHOWN, "tests", "pyproject.toml") if path != Path(__file__)]
    assert [
        f"{path}: {line}"
        for path in texts
        for line in path.read_text(errors="replace").splitlines()
        if wrong.search(line)
    ] == []
    assert PROJECT["name"] == "kendama-cli"


def test_one_page_speaks_of_an_index_and_says_that_none_has_it_yet() -> None:
    places = [path for path in files(*SHOWN) if re.search(r"install ['\"]?kendama-cli", path.read_text())]
    assert [str(path.relative_to(ROOT)) for path in places] == ["docs/tutorials/start.md"]
    assert "It is on no package index yet" in places[0].read_text()


def test_every_extra_that_a_line_names_is_there() -> None:
    for line, where in LINES.items():
        for word in packages(line):
            name, _, extras = word.rstrip("]").partition("[")
            if name in (".", "kendama-cli"):
                assert set(filter(None, extras.split(","))) <= set(PROJECT["optional-dependencies"]), where
    assert {".", "'.[play]'", "'.[robots]'", "-e '.[test]'", "-e my-learner", ". optuna"} <= set(LINES)


def resolved(line: str, wheel: Path, folder: Path) -> str:
    """What uv says against a line, nothing where it finds a release of everything that the line asks for."""
    asked = folder / "asked.in"
    words = []
    for word in packages(line):
        name, bracket, extras = word.partition("[")
        ours, place = OURS.get(name, (name, None))
        words.append(f"{ours}{bracket}{extras}" + (f" @ {place.as_uri()}" if place else ""))
    asked.write_text("\n".join(words))
    command = [*UV, "compile", "-q", "--python-version", "3.12", "--find-links", str(wheel.parent), str(asked)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    return done.stderr if done.returncode else ""


@pytest.fixture(scope="module")
def index(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    """A package index that answers; the tests that need one are skipped where none does."""
    if problem := resolved("numpy", wheel, tmp_path_factory.mktemp("index")):
        pytest.skip(f"no package index answers: {problem}")


@pytest.mark.slow  # asks a package index
@pytest.mark.usefixtures("index")
@pytest.mark.parametrize("line", sorted(LINES))
def test_what_a_line_asks_for_is_found(line: str, wheel: Path, tmp_path: Path) -> None:
    assert resolved(line, wheel, tmp_path) == "", LINES[line]


@pytest.mark.slow  # downloads what kendama needs
@pytest.mark.usefixtures("index")
def test_two_lines_fill_an_empty_environment_with_the_command_the_page_and_a_learner(tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(tmp_path)], check=True)
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL_ENV"))}
    python = ["--python", str(tmp_path / "bin" / "python")]
    for line, where in (("'.[play]'", ROOT), ("-e my-learner", MY_LEARNER.parent)):
        assert line in LINES
        subprocess.run([*UV, "install", "-q", *python, *shlex.split(line)], check=True, cwd=where, env=clean)
    said = subprocess.check_output([*UV, "list", "-q", "--format=json", *python], env=clean)
    versions = {one["name"]: one["version"] for one in json.loads(said)}
    assert versions["kendama-cli"] == __version__
    assert {"starlette", "my-learner"} < set(versions)
    assert "kendama" not in versions
    command = [tmp_path / "bin" / "kendama", "doctor"]
    doctor = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=clean)
    assert doctor.returncode == 0, doctor.stdout + doctor.stderr
    assert "mine" in doctor.stdout
