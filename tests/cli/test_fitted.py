"""Output on a terminal of 80 columns: no line is longer, no word and no number is broken; a pipe gets whole lines."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from kendama_cli.cli.fitted import hanging, table_lines, wrapped
from kendama_cli.cli.main import main
from tests.docs.output import type_line
from tests.toy_project import ToyProject

TIME = re.compile(r"\d{4}-\d\d-\d\d|\d\d:\d\d")
ROWS = [["00001-4d4707", "swingup", "simulation/engine=rail learn.alpha=0.3", "121 [24.5, 217.5]", ""]]
HEAD = ["run", "pipeline", "overrides", "learn.rollouts_to_solved", "tags"]


@pytest.mark.parametrize("width", [0, 100, 60, 40, 30, 20])
def test_a_table_keeps_each_word_and_number_at_any_width(width: int) -> None:
    lines = table_lines(ROWS, HEAD, width=width)
    assert not width or max(map(len, lines)) <= width
    told = "\n".join(lines)
    words = {word for line in lines for word in line.split()}
    assert width == 20 or "00001-4d4707" in words
    if width >= 40:
        assert words >= {*ROWS[0][2].split(), "swingup", HEAD[3]}
        assert "121 [24.5, 217.5]" in told
        assert "..." not in told
    assert ("tags" in words) == (not width or width >= 100)


def test_a_narrow_table_loses_its_optional_columns_first() -> None:
    (head, *_) = table_lines(ROWS, HEAD, width=70, optional=["pipeline", "run"])
    assert head.split() == ["run", "overrides", "learn.rollouts_to_solved"]


def test_a_word_that_is_too_long_ends_in_dots_in_a_table_and_stays_whole_in_a_line() -> None:
    path = "/a/long/path/to/something/of/a/user"
    assert table_lines([["a", path]], width=20)[0].endswith("...")
    assert hanging(f"see {path}", 20)[-1].strip() == path


def test_a_line_breaks_after_commas_and_keeps_a_command_in_one_piece() -> None:
    assert wrapped("rmse_mm 0.33, n_parameters 22, width 1", 30) == ["rmse_mm 0.33, n_parameters 22,", "width 1"]
    text = "the names are from before; type 'kendama cache migrate' once, or kendama run seed=1; and so on"
    for width in range(30, 90):
        told = "\n".join(hanging(text, width))
        assert "'kendama cache migrate'" in told
        assert "kendama run seed=1;" in told
        assert max(map(len, told.splitlines())) <= width


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a home of two long-named runs."""
    pytest.importorskip("pyte")
    toy = ToyProject(tmp_path_factory.mktemp("toy"))
    for seed in (1, 2):
        toy.run_json(f"seed={seed}", "toy.steps=6", "toy.pause_s=0.001")
    return toy.folder


@pytest.mark.parametrize(
    "line",
    [
        "kendama",
        "kendama runs",
        "NO_COLOR=1 kendama runs",
        "kendama runs --columns started,pipeline,overrides,outcome,roll.sum",
        "kendama diff 1 2",
        "kendama cache ls",
        pytest.param("kendama doctor", marks=pytest.mark.slow),
        "kendama course list",
        "kendama robot describe robot.home_rad=null",
        "kendama runs --filter nothing=3",
    ],
)
def test_no_line_on_a_terminal_is_broken_by_it(folder: Path, line: str) -> None:
    type_line(f"({line}) > whole.txt 2>&1", folder)
    whole = set((folder / "whole.txt").read_text().split())
    shown = {word for one in type_line(line, folder) for word in one.split() if not TIME.fullmatch(word)}
    assert shown
    wider = " ".join(word for word in whole if len(word) > 60)  # a path that no terminal of 80 columns holds in one
    assert {word for word in shown - whole if not word.startswith("~") and word not in wider} == set()


def test_a_pipe_gets_a_line_for_each_run(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "40")
    assert main(["runs"]) == 0
    out, err = capsys.readouterr()
    assert len(out.splitlines()) == 3
    assert "toy.pause_s=0.001" in out
    assert "home: .kendama" in err
