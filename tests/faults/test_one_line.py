"""Whatever a user, a shell or a system does that cannot work is told in one line, with the right exit code."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.faults.test_interruptions import checkpoints, wait_for
from tests.toy_project import ToyProject, statuses

UNWANTED = ("Traceback", "unexpected", "Exception ignored")


def started(
    toy: ToyProject,
    *arguments: str | bytes,
    output: str = "",
    before: Callable[[], None] | None = None,
    folder: bytes | None = None,
) -> tuple[int, list[str]]:
    """Exit code and lines on standard error of ``kendama ARGUMENTS``; its standard output goes to ``output``."""
    command = [os.fsencode(word) for word in toy.command()] + [os.fsencode(word) for word in arguments]
    with open(output or os.devnull, "wb") as stream:
        done = subprocess.run(
            command,
            cwd=folder or toy.folder,
            env=toy.environment(),
            stdin=subprocess.DEVNULL,
            stdout=stream,
            stderr=subprocess.PIPE,
            preexec_fn=before,
            timeout=240,
            check=False,
        )
    lines = done.stderr.decode(errors="backslashreplace").splitlines()
    assert not [line for line in lines for words in UNWANTED if words in line], lines
    return done.returncode, lines


def test_a_home_or_a_folder_that_is_not_utf_8_is_one_line(toy: ToyProject) -> None:
    code, lines = started(toy, "run", "-p", "toy", "--home", b"h\xff\xfe")
    assert (code, len(lines)) == (2, 1)
    assert "--home" in lines[0]
    assert "is not UTF-8 text" in lines[0]
    odd = os.fsencode(toy.folder) + b"/f\xff"
    os.mkdir(odd)
    code, lines = started(toy, "runs", folder=odd)
    assert (code, len(lines)) == (2, 1)
    assert "is not UTF-8 text" in lines[0]


def test_a_home_of_a_user_who_is_not_there_is_a_folder_of_that_name(toy: ToyProject) -> None:
    assert started(toy, "runs", "--home", "~nobody-of-this-name/x") == (0, ["home: ~nobody-of-this-name/x"])


@pytest.mark.parametrize(
    "command",
    [["runs"], ["run", "-p", "toy"], pytest.param(["run", "-p", "toy", "--json"], marks=pytest.mark.slow), ["--help"]],
)
def test_output_that_cannot_be_written_is_one_line(toy: ToyProject, command: list[str]) -> None:
    if command[0] == "run":
        toy.run_json()
    code, lines = started(toy, *command, output="/dev/full")
    assert code == 1
    assert lines[-1] == "kendama: the output cannot be written: No space left on device"
    assert all(line.split(":")[0] in ("roll", "total") for line in lines[:-1])


def test_too_few_open_files_are_one_line(toy: ToyProject) -> None:
    def few(number: int) -> Callable[[], None]:
        return lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (number, number))

    for number in (8, 13):
        code, lines = started(toy, "run", "-p", "toy", f"seed={number}", before=few(number))
        assert code in (0, 1, 2)
        assert code == 0 or "Too many open files" in " ".join(lines), lines
        assert len([line for line in lines if line.startswith("kendama: ")]) <= 1
    assert statuses(toy.run_json("seed=8")) in ({"roll": "ran", "total": "ran"}, {"roll": "cached", "total": "cached"})
    toy.kendama("cache", "verify")


def test_a_closed_terminal_ends_a_run_as_ctrl_c_does(toy: ToyProject) -> None:
    slow = ("toy.steps=30", "toy.pause_s=0.05")
    process = toy.start("run", "-p", "toy", *slow)
    wait_for(lambda: len(checkpoints(toy)) > 1)
    process.send_signal(signal.SIGHUP)
    _, printed = process.communicate(timeout=60)
    assert process.returncode == 130
    assert printed.splitlines()[-1].startswith("kendama: interrupted")
    assert json.loads(toy.kendama("runs", "--json").stdout)[-1]["outcome"] == "interrupted"
    again = toy.start("run", "-p", "toy", "--json", *slow)
    os.killpg(os.getpgid(again.pid), 0)  # it is there
    assert statuses(json.loads(again.communicate(timeout=120)[0])) == {"roll": "ran", "total": "ran"}


def test_nohup_keeps_a_run_going_when_the_terminal_closes(toy: ToyProject) -> None:
    process = subprocess.Popen(
        ["nohup", *toy.command("run", "-p", "toy", "toy.steps=10", "toy.pause_s=0.05")],
        cwd=toy.folder,
        env=toy.environment(),
        stderr=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    )
    wait_for(lambda: checkpoints(toy))
    process.send_signal(signal.SIGHUP)
    assert process.wait(timeout=120) == 0


def test_runs_are_in_the_order_in_which_they_began_whatever_the_clock_says(
    toy: ToyProject, monkeypatch: pytest.MonkeyPatch
) -> None:
    from kendama_cli.pipeline.record import begin, find_run, past_runs  # noqa: PLC0415

    for year in (2030, 2020, 2025):
        monkeypatch.setattr(time, "gmtime", lambda year=year: time.struct_time((year, 1, 1, 0, 0, 0, 0, 1, 0)))
        record = begin(toy.home, "toy", [f"seed={year}"], {})
        record.outcome = "done"
        record.save()
    assert [run["overrides"] for run in past_runs(toy.home)] == [["seed=2030"], ["seed=2020"], ["seed=2025"]]
    assert find_run(toy.home, None)["overrides"] == ["seed=2025"]
    assert find_run(toy.home, "2")["overrides"] == ["seed=2020"]
    from kendama_cli.store.garbage import collect_garbage  # noqa: PLC0415
    from kendama_cli.store.store import Store  # noqa: PLC0415

    collect_garbage(Store(toy.home), keep_runs=1)
    assert [run["overrides"] for run in past_runs(toy.home)] == [["seed=2025"]]
    assert begin(toy.home, "toy", [], {}).run.startswith("00004-")


@pytest.mark.parametrize("lines", ["  1: {stage: toy_roll}", "  true: {stage: toy_roll}", "  more: &m {needs: *m}"])
def test_a_pipeline_that_is_no_plain_yaml_is_one_line(toy: ToyProject, lines: str) -> None:
    path = toy.folder / "pipelines/bad.yaml"
    path.write_text((toy.folder / "pipelines/toy.yaml").read_text() + lines + "\n")
    code, printed = started(toy, "plan", "-p", "bad")
    assert (code, len(printed)) == (2, 1)
    assert printed[0].startswith(f"kendama: {path}: not a pipeline: ")


INDEXES = ("files.json", "latest/toy/roll.json", "latest/toy/total.json", "composed", "unchanged")


def test_an_index_of_a_wrong_shape_blocks_nothing(toy: ToyProject) -> None:
    time.sleep(2.1)  # younger files are not remembered
    toy.run_json()
    toy.run_json()
    paths = [path for name in INDEXES for path in [toy.home / "index" / name] if path.is_file()]
    paths += [path for name in INDEXES for path in (toy.home / "index" / name).glob("*.json")]
    assert len(paths) >= 4  # that of a run with nothing to do is kept only where nothing installed is young
    for content in ("[1]", '{"roll": 1}'):
        for path in paths:
            path.write_text(content)
        assert started(toy, "plan", "-p", "toy") == (0, [])
        for path in paths:
            path.write_text(content)
        assert statuses(toy.run_json()) == {"roll": "cached", "total": "cached"}
    for path in paths:
        path.write_text("[1]")
    damaged = json.loads(toy.kendama("cache", "verify", "--json", expect=1).stdout)["damaged"]
    assert sorted(one["path"] for one in damaged) == sorted(map(str, paths))
    toy.kendama("cache", "gc")
    toy.kendama("cache", "verify")


def test_an_environment_variable_of_the_pipelines_own_overrides_is_seen_by_the_quick_way_too(
    toy: ToyProject, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = toy.folder / "pipelines/toy.yaml"
    seeded = """["+toy=default", 'seed="${oc.decode:${oc.env:SEED}}"']"""
    path.write_text(path.read_text().replace('["+toy=default"]', seeded))
    time.sleep(2.1)
    for seed, expected in (("4", "ran"), ("4", "cached"), ("4", "cached"), ("6", "ran"), ("4", "cached")):
        monkeypatch.setenv("SEED", seed)
        assert statuses(toy.run_json()) == {"roll": expected, "total": expected}, seed


READ_ONLY = """
set -e
mount --bind "$1" "$1"
mount -o remount,bind,ro "$1"
shift
exec "$@"
"""


def read_only(home: Path) -> list[str]:
    """What runs a command in a namespace where ``home`` cannot be written, by root neither."""
    namespace = ["unshare", "--mount"] if os.geteuid() == 0 else ["unshare", "--map-root-user", "--mount"]
    prefix = [*namespace, "sh", "-c", READ_ONLY, "sh", str(home)]
    if subprocess.run([*prefix, "true"], capture_output=True, check=False).returncode != 0:
        pytest.skip("no mount namespace here")
    return prefix


def test_a_run_with_everything_cached_works_on_a_home_that_cannot_be_written(toy: ToyProject) -> None:
    toy.run_json()
    before = {path: path.read_bytes() for path in toy.home.rglob("*") if path.is_file()}
    prefix = read_only(toy.home)

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*prefix, *toy.command("run", "-p", "toy", *arguments)],
            cwd=toy.folder,
            env=toy.environment(),
            capture_output=True,
            text=True,
            timeout=240,
            check=False,
        )

    for _ in range(2):
        done = run()
        assert done.returncode == 0, done.stderr
        assert [line.split()[:2] for line in done.stdout.splitlines()[:2]] == [["roll", "cached"], ["total", "cached"]]
        assert f"not recorded: {toy.home} cannot be written" in done.stdout
    document = json.loads(run("--json").stdout)
    assert (document["outcome"], document["recorded"]) == ("done", False)
    refused = run("seed=3")
    assert refused.returncode == 1
    assert refused.stderr.splitlines()[-1].startswith("kendama: cannot write ")
    assert "the file system is read-only" in refused.stderr
    assert {path: path.read_bytes() for path in toy.home.rglob("*") if path.is_file()} == before
