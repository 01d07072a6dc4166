"""Mistakes of people who type a command for the first time: each says the line to type next."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.typed import kendama, refused

UP_TO_CAPTURE = ("-p", "imitation", "--until", "capture")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one recording under several names."""
    made = tmp_path_factory.mktemp("newcomer")
    (swing,) = Path("data/demonstrations").glob("swing-01.csv")
    for name in ("swing.csv", "a,b.csv", "Ανδρέας [1].csv", "d(1)=x/swing.csv", "数据/摆.csv", "l’été.csv"):
        (made / name).parent.mkdir(exist_ok=True)
        shutil.copy(swing, made / name)
    return made


@pytest.fixture
def here(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(folder)
    monkeypatch.setenv("KENDAMA_HOME", str(folder / "home"))
    return folder


LINES = {
    ("run", "swing.csv"): "type capture.path=swing.csv",
    ("run", "数据"): "type 'capture.path=数据/*.csv'",
    ("run", "arm.urdf"): "type robot=urdf robot.path=arm.urdf",
    ("run", "imitation"): "type -p imitation",
    ("run", "learn"): "type --until learn",
    ("run", "ur5"): "type robot=ur5",
    ("run", "robot"): "type robot=CHOICE; allowed: fr3, iiwa",
    ("run", "--capture.path=swing.csv"): "type capture.path=swing.csv without dashes",
    ("run", "--capture.path", "swing.csv"): "type capture.path=swing.csv without dashes",
    ("run", "--robot", "ur5"): "type robot=ur5 without dashes",
    ("run", "--seed", "3"): "type seed=3 without dashes",
    ("run", "--frce", "learn"): "did you mean '--force'?",
    ("run", "\N{EN DASH}p", "imitation"): "type -p imitation",
    ("run", "capture.path", "=", "swing.csv"): "type capture.path=swing.csv",
    ("run", "capture.path=", "swing.csv"): "type capture.path=swing.csv",
    ("run", "capture.path", "=swing.csv"): "type capture.path=swing.csv",
    ("run", "seed = 3"): "type seed=3",
    ("run", "learner=lucky"): "type learn/learner=random_replay; allowed: agent",
    ("run", "learn/learner=lukcy"): "did you mean 'learn/learner=random_replay'? Allowed: agent",
    ("run", "learner=random_replay"): "type learn/learner=random_replay; allowed: agent",
    ("run", "task=hard"): "type learn/task=hard; allowed: easy",
    ("run", "learn.learner=random_replay"): "type learn/learner=random_replay",
    ("run", "robot=UR5"): "did you mean 'robot=ur5'? Allowed: fr3",
    ("run", "Robot=ur5"): "did you mean 'robot'?",
    ("run", "capture=file.csv"): "type capture.path=file.csv; allowed: body",
    ("run", "capture.path=\N{LEFT DOUBLE QUOTATION MARK}swing.csv\N{RIGHT DOUBLE QUOTATION MARK}"): (
        "type capture.path=swing.csv"
    ),
    ("run", "learn.alpha=\N{MINUS SIGN}1"): "type learn.alpha=-1",
    ("run", "learn.alpha=0,3"): "type learn.alpha=0.3, or for one run each kendama sweep learn.alpha=0,3",
    ("run", "learn.alpha=0.3m"): "type learn.alpha=0.3, without a unit",
    ("run", "learn.alpha='0,3'"): "type learn.alpha=0.3",
    ("run", "learn.alpha=abc"): "must be a number above 0 and at most 1, not 'abc'; 'kendama explain learn.alpha'",
    ("run", "transfer.baseline=yes"): "type transfer.baseline=true",
    ("run", "capture.unit=MM"): "did you mean 'capture.unit=mm'? Allowed: m, cm, mm",
    ("run", "seed=0..9"): "type kendama sweep 'seed=range(0,10)'",
    ("sweep", "seed=0..9"): "type kendama sweep 'seed=range(0,10)'",
    ("run", "seed=1,2"): "type kendama sweep seed=1,2 for one run each",
    ("run", "capture.path=[swing.csv, swing.csv"): "type 'capture.path=[swing.csv, swing.csv]'",
    ("run", "capture.path='swing.csv"): "type capture.path=swing.csv",
    ("run", "capture.path=."): "type 'capture.path=./*.csv' for all files in it",
    ("run", "capture.path=swinng.csv"): "did you mean capture.path=swing.csv? Looked in: ",
    ("run", "capture.path=nowhere/*.csv"): "there is no folder 'nowhere'; looked in: ",
    ("run", "capture.path=数据/摇.csv"): "did you mean 'capture.path=数据/摆.csv'?",
    ("run", "-p", "Imitaton"): "did you mean '-p imitation'? There are: ",
    ("run", "--until", "lern"): "did you mean '--until learn'? It has: capture",
    ("runn",): "did you mean 'kendama run'?",
    ("swing.csv",): "type kendama run capture.path=swing.csv",
    ("robot=ur5",): "type kendama run robot=ur5",
    ("learn",): "type kendama run --until learn",
}


@pytest.mark.parametrize("words", LINES, ids=" ".join)
def test_a_mistake_says_what_to_type(here: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...]) -> None:
    arguments = (*words, *UP_TO_CAPTURE) if words[0] == "run" and not {"-p", "--until"} & {*words} else words
    assert LINES[words] in refused(capsys, *arguments)


def test_a_run_that_is_not_there_is_told_with_the_newest(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert kendama(capsys, "run", "capture.path=swing.csv", *UP_TO_CAPTURE)[0] == 0
    assert "the newest is " in refused(capsys, "report", "99")


@pytest.mark.parametrize(
    "name", ["a,b.csv", "Ανδρέας [1].csv", "d(1)=x/*.csv", "数据/摆.csv", "l’été.csv", "数据/*.csv"]
)
def test_a_path_is_taken_with_all_signs_that_a_file_name_may_have(
    here: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    code, out, _ = kendama(capsys, "plan", f"capture.path={name}", *UP_TO_CAPTURE)
    assert (code, out.split()[0]) == (0, "capture")
