"""Wrong usage: one line, the right exit code, never a traceback."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import kendama_cli
from kendama_cli.cli import version_line
from tests import warm_command
from tests.cli.typed import kendama
from tests.toy_project import ToyProject


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> ToyProject:
    """One project for all commands that leave no file: what it composed once is in its index.

    It has no configuration of its own, so that commands begin with what the process that they are forked of composed.
    """
    toy = ToyProject(tmp_path_factory.mktemp("laboratory"))
    shutil.rmtree(toy.folder / "conf")
    return toy


def complaint(toy: ToyProject, *arguments: str) -> str:
    done = toy.kendama(*arguments, expect=2)
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith("kendama: ")
    assert done.stdout == ""
    return lines[0].removeprefix("kendama: ")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["run", "learn.solved_streek=3"],
            "unknown key 'learn.solved_streek', did you mean 'learn.count.solved_streak'?",
        ),
        (["run", "learn.alph=0.5"], "unknown key 'learn.alph', did you mean 'learn.alpha'?"),
        (["run", "+learn.alph=0.5"], "unknown key 'learn.alph', did you mean 'learn.alpha'?"),
        (["run", "++learn.alph=0.5"], "unknown key 'learn.alph', did you mean 'learn.alpha'?"),
        (["run", "+alpha=0.5"], "unknown key 'alpha'"),
        (
            ["run", "learn/tsk=easy"],
            "unknown group 'learn/tsk', did you mean 'learn/task'? Available: adapt",
        ),
        (["run", "sed=3"], "unknown key 'sed', did you mean 'seed'?"),
        (["run", "learn.alpha=many"], "'learn.alpha' must be a number above 0 and at most 1, not 'many'"),
        (["run", "learn.alpha=-1"], "'learn.alpha' is -1"),
        (["run", "seed=-1"], "'seed' is -1; allowed: a whole number, 0 or more"),
        (["run", "seed=1.5"], "'seed' is 1.5"),
        (["run", "=3"], "'=3' has no key; type KEY=VALUE"),
        (["run", "learn.alpha=nan"], "'learn.alpha' must be a finite number, not nan"),
        (["run", "learn.alpha=1e400"], "'learn.alpha' must be a finite number, not inf"),
        (["run", "learn=null"], "'learn=null' must name one choice of the group 'learn'; allowed: sarsa"),
        (["run", "capture=[file]"], "'capture=[file]' must name one choice of the group 'capture'"),
        (["run", "capture.path=\udcff.csv"], "is not UTF-8 text; rename"),
        (["run", "robot.path=conf"], "robot.path: 'conf' is a folder; name a file"),
        (["sweep", "capture.path=glob(*.csv)"], "glob() picks options of a group, and 'capture.path' is none"),
        (["run", "seed=1,2"], "type kendama sweep seed=1,2"),
        (["run", "seed"], "'seed' is not KEY=VALUE; type seed=VALUE"),
        (["run", "seed=[1"], "has a bracket that is not closed; type 'seed=[1]'"),
        (["run", "hydra.verbose=true"], "would change Hydra itself"),
        (["run", "~learn"], "learn"),
        (
            ["run", "capture=fil"],
            "'capture' is 'fil', did you mean 'capture=file'? Allowed: body, file, haptic, iiwa_kendama, marker, "
            "marker_live, mocap, phone, play, video",
        ),
        (["run", "capture.path=nowhere.csv"], "capture.path: no such file 'nowhere.csv'"),
        (["run", "capture=play"], "; 'kendama play' keeps tries there"),
        (["run", "-p", "kendma"], "no pipeline 'kendma'"),
        (["run", "--until", "lern"], "--until lern: pipeline 'kendama' has no such stage"),
        (["run", "--force", "lern"], "--force lern: pipeline 'kendama' has no such stage"),
        (["run", "--frce", "learn"], "No such option: --frce"),
        (["rum"], "No such command 'rum'"),
        (["sweep", "learn.alph=1,2"], "unknown key 'learn.alph', did you mean 'learn.alpha'?"),
        (["config", "learn.alph=1"], "unknown key 'learn.alph', did you mean 'learn.alpha'?"),
        (["report", "2020"], "no runs in"),
        (["run", "--config-dir", "nowhere"], "--config-dir nowhere: no such folder"),
        (["log", "info", "nowhere.mcap"], "nowhere.mcap"),
    ],
)
def test_wrong_usage_is_one_line_with_exit_code_2(
    here: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    code, out, err = kendama(capsys, *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("kendama: ")
    assert message in err


def test_a_users_conf_and_pipelines_come_before_the_bundled(toy_beside_ours: ToyProject) -> None:
    (toy_beside_ours.folder / "conf/learn").mkdir()
    (toy_beside_ours.folder / "conf/learn/mine.yaml").write_text("defaults: [sarsa]\nalpha: 0.123\n")
    assert "alpha: 0.123" in toy_beside_ours.kendama("config", "learn=mine").stdout
    elsewhere = toy_beside_ours.folder / "elsewhere/conf/learn"
    elsewhere.mkdir(parents=True)
    (elsewhere / "mine.yaml").write_text("defaults: [sarsa]\nalpha: 0.321\n")
    named = toy_beside_ours.kendama("config", "learn=mine", "--config-dir", "elsewhere").stdout
    assert "alpha: 0.321" in named
    assert "alpha: 0.321" in toy_beside_ours.kendama("config", "learn=mine", "--config-dir", "elsewhere/conf").stdout
    assert "alpha: 0.321" in toy_beside_ours.kendama("--config-dir", "elsewhere", "config", "learn=mine").stdout


def test_home_is_taken_before_or_after_the_command_or_from_the_environment(toy: ToyProject) -> None:
    toy.kendama("--home", "one", "run", "-p", "toy", "--until", "roll")
    toy.kendama("run", "-p", "toy", "--until", "roll", "--home", "two")
    environment = {**toy.environment(), "KENDAMA_HOME": "three"}
    subprocess.run(toy.command("run", "-p", "toy", "--until", "roll"), cwd=toy.folder, env=environment, check=True)
    for home in ("one", "two", "three"):
        assert list((toy.folder / home).glob("runs/*.json")), home
    assert not toy.home.exists()


def test_a_first_run_tells_of_its_home_and_of_one_above(toy: ToyProject) -> None:
    first = toy.kendama("run", "-p", "toy", "--until", "roll", "--home", ".kendama").stderr
    assert "made the home .kendama: " in first
    assert (toy.folder / ".kendama/.gitignore").read_text().endswith("\n*\n")
    assert "made the home" not in toy.kendama("run", "-p", "toy", "--until", "roll", "--home", ".kendama").stderr
    below = toy.folder / "sub/.kendama"
    assert f"--home {toy.folder / '.kendama'}" in toy.kendama("report", "--home", str(below), expect=2).stderr


def test_a_home_that_is_a_file_is_told(toy: ToyProject) -> None:
    (toy.folder / "taken").write_text("mine")
    error = toy.kendama("runs", "--home", "taken", expect=2).stderr
    assert error == f"kendama: --home {toy.folder / 'taken'} is a file; name a folder, which need not exist yet\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("stages: [roll]\n", "a pipeline needs 'stages:' with at least one stage"),
        ("stages: {roll: {stage: rol}}\n", "no stage 'rol'"),
        (
            "stages: {roll: {stage: toy_roll, needs: [dice]}}\n",
            "stage 'roll' needs 'dice', which is not in this pipeline",
        ),
        ("stages: {a: {stage: toy_roll, needs: [b]}, b: {stage: toy_roll, needs: [a]}}\n", "in a circle: a, b"),
        ("stages: {roll: {stage: toy_roll, confg: [toy]}}\n", "stage 'roll' has an unknown key 'confg'"),
        ("stages: {roll: {stage: toy_roll, config: [toys]}}\n", "reads node 'toys'"),
        ("stages: {../roll: {stage: toy_roll}}\n", "stage '../roll' has a name with other signs than letters"),
        ("stages: {roll: [\n", "not a pipeline"),
        ("\0", "not a pipeline"),
    ],
)
def test_a_wrong_pipeline_is_one_line_that_names_the_file(toy: ToyProject, text: str, message: str) -> None:
    (toy.folder / "pipelines/wrong.yaml").write_text(text)
    error = complaint(toy, "plan", "-p", "wrong")
    assert message in error
    assert "wrong" in error


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"kind: [file\n", "mine.yaml"),
        (b"- a\n", "'learn/mine'"),
        (b"\xff\xfe", "conf/learn/mine.yaml as UTF-8"),
        (b"defaults: 3\n", "Invalid defaults list in 'learn/mine'"),
        (b"alpha: .nan\ndefaults: [sarsa, _self_]\n", "'learn.alpha' must be a finite number"),
        (b"kind: ${oc.env:NOWHERE}\n", "Environment variable 'NOWHERE' not found"),
        (None, "Could not find 'learn/mine'"),
    ],
)
def test_a_wrong_file_in_a_users_conf_is_one_line(
    toy_beside_ours: ToyProject, content: bytes | None, message: str
) -> None:
    (toy_beside_ours.folder / "conf/learn").mkdir()
    mine = toy_beside_ours.folder / "conf/learn/mine.yaml"
    if content is None:
        mine.symlink_to("nowhere.yaml")
    else:
        mine.write_bytes(content)
    assert message in complaint(toy_beside_ours, "config", "learn=mine")
    toy_beside_ours.kendama("config")


def test_debug_shows_the_traceback(toy: ToyProject, monkeypatch: pytest.MonkeyPatch) -> None:
    environment = {**toy.environment(), "KENDAMA_DEBUG": "1"}
    done = subprocess.run(
        toy.command("run", "learn.alph=1"), cwd=toy.folder, env=environment, capture_output=True, text=True, check=False
    )
    assert "Traceback" in done.stderr
    assert "ConfigError" in done.stderr


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("kendama run -p im", "imitation"),
        ("kendama run --until tra", "transfer"),
        ("kendama run capture=ii", "capture=iiwa_kendama"),
        ("kendama run learn.alp", "learn.alpha="),
        ("kendama plan --force le", "learn"),
    ],
)
def test_completion_offers_stages_pipelines_groups_and_keys(laboratory: ToyProject, words: str, offered: str) -> None:
    environment = {
        **laboratory.environment(),
        "_KENDAMA_COMPLETE": "complete_bash",
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split()) - 1),
    }
    done = warm_command.kendama([], laboratory.folder, environment, 240)
    assert offered in done.stdout.split(), (done.stdout, done.stderr)


@pytest.mark.parametrize(
    ("line", "replies"),
    [
        ("kendama run capture=ii", ["iiwa_kendama"]),
        ("kendama run encode=paper capture=moc", ["mocap"]),
        ("kendama run capture.path='", []),
    ],
)
def test_bash_which_cuts_words_at_equals_signs_is_answered_with_what_follows(
    toy: ToyProject, line: str, replies: list[str]
) -> None:
    words = " ".join(f'"{word}"' for word in line.replace("=", " = ").split())
    script = f"""
        kendama() {{ :; }}
        eval "$({sys.executable} -m kendama_cli.cli.main --show-completion bash)"
        function env() {{ command env "${{@:1:3}}" {sys.executable} -m kendama_cli.cli.main; }}
        COMP_WORDS=({words}); COMP_CWORD=$(( ${{#COMP_WORDS[@]}} - 1 ))
        _kendama_completion kendama; printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    done = subprocess.run(
        ["bash", "-c", script], cwd=toy.folder, env=toy.environment(), capture_output=True, text=True, check=False
    )
    assert done.stdout.split() == replies, done.stderr


def test_the_version_tells_commit_and_libraries(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = version_line.version_text().splitlines()
    assert first.startswith(f"kendama {kendama_cli.__version__}")
    assert {"python", "dartpy", "numpy"} <= {part.split()[0] for part in second.split(", ")}
    clone = tmp_path / "clone"
    (clone / "kendama_cli").mkdir(parents=True)
    (clone / "pyproject.toml").touch()
    monkeypatch.setattr(version_line, "__file__", str(clone / "kendama_cli" / "cli" / "version_line.py"))
    assert "commit" not in version_line.version_text()
    git = ["git", "-C", str(clone), "-c", "user.name=a", "-c", "user.email=a@b"]
    for words in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "one"]):
        subprocess.run([*git, *words], check=True)
    commit = subprocess.check_output([*git, "rev-parse", "--short=10", "HEAD"], text=True).strip()
    assert version_line.version_text().splitlines()[0].endswith(f"(commit {commit})")
    (clone / "pyproject.toml").write_text("changed\n")
    assert version_line.version_text().splitlines()[0].endswith(f"(commit {commit}, changed since)")
