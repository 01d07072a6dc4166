"""Stages that are computed again and those that are not."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from kendama_cli.pipeline.command_cache import SETTLED_S
from kendama_cli.pipeline.plan import _changed
from kendama_cli.store.garbage import verify
from kendama_cli.store.store import Store
from tests.portable import portable_is_slow
from tests.toy_project import ToyProject, artifact_bytes, statuses


@pytest.mark.usefixtures("each_way")
def test_a_second_run_computes_nothing(toy: ToyProject) -> None:
    assert statuses(toy.run_json()) == {"roll": "ran", "total": "ran"}
    assert statuses(toy.run_json()) == {"roll": "cached", "total": "cached"}


def test_the_document_has_the_promised_form(toy: ToyProject) -> None:
    document = toy.run_json("seed=3")
    assert set(document) >= {"run", "pipeline", "overrides", "stages"}
    assert document["pipeline"] == "toy"
    assert document["overrides"] == ["seed=3"]
    for stage in document["stages"]:
        assert set(stage) >= {"name", "key", "status", "seconds", "artifact", "metrics"}
        assert Path(stage["artifact"]).is_dir()
    assert document["stages"][0]["metrics"]["seen_nan"] is None
    assert document["stages"][0]["metrics"]["blas_threads"] == 1, "sums do not depend on the number of cores"


def test_the_seed_drives_the_randomness_and_reruns_what_draws(toy: ToyProject) -> None:
    first, second = toy.run_json("seed=1"), toy.run_json("seed=2")
    assert first["stages"][0]["metrics"]["sum"] != second["stages"][0]["metrics"]["sum"]
    assert statuses(toy.run_json("seed=1")) == {"roll": "cached", "total": "cached"}


def test_two_homes_give_the_same_bytes(toy: ToyProject) -> None:
    first, second = toy.run_json("--home", "one"), toy.run_json("--home", "two")
    assert artifact_bytes(first) == artifact_bytes(second)


def test_a_comment_reruns_nothing_but_code_does(toy: ToyProject) -> None:
    toy.run_json()
    numbers = toy.folder / "lib/toy/numbers.py"
    numbers.write_text("\n# a comment\nSCALE = 1.0\n\n")
    assert statuses(toy.run_json()) == {"roll": "cached", "total": "cached"}
    numbers.write_text("SCALE = 2.0\n")
    plan = json.loads(toy.kendama("plan", "-p", "toy", "--json").stdout)
    assert plan["stages"][0]["reasons"] == ["code toy/numbers.py changed"]
    assert statuses(toy.run_json()) == {"roll": "ran", "total": "ran"}


def test_plan_names_the_key_with_its_old_and_new_value(toy: ToyProject) -> None:
    assert toy.kendama("plan", "-p", "toy").stdout.splitlines()[0].split(None, 2) == ["roll", "run", "never ran"]
    toy.run_json()
    lines = toy.kendama("plan", "-p", "toy", "toy.steps=21").stdout.splitlines()
    assert lines[0].split(None, 2) == ["roll", "run", "config toy.steps 20 -> 21"]
    assert lines[1].split(None, 2) == ["total", "run", "input roll changed; config toy.steps 20 -> 21"]


def test_a_stage_whose_input_came_out_the_same_is_not_run_again(toy_beside_ours: ToyProject) -> None:
    toy_beside_ours.run_json()
    # another pause gives the same numbers, but total reads the same node: only a node of its own would spare it
    assert statuses(toy_beside_ours.run_json("toy.pause_s=0.001")) == {"roll": "ran", "total": "ran"}
    (toy_beside_ours.folder / "pipelines/split.yaml").write_text(
        'overrides: ["+toy=default"]\nstages:\n  roll: {stage: toy_roll, config: [toy, seed]}\n'
        "  total: {stage: toy_total, needs: [roll], config: {toy: game}}\n"
    )
    toy_beside_ours.kendama("run", "-p", "split")
    document = json.loads(toy_beside_ours.kendama("run", "-p", "split", "--json", "toy.pause_s=0.002").stdout)
    assert statuses(document) == {"roll": "ran", "total": "cached"}


def test_a_users_file_with_a_librarys_name_is_not_imported_by_the_worker(toy: ToyProject) -> None:
    for name in ("numpy", "json", "random"):
        (toy.folder / f"{name}.py").write_text("raise RuntimeError('a file of the user')\n")
    # unlike python -m, the installed command does not look for modules in the current folder
    command = [toy.command()[0], "-P", *toy.command("run", "-p", "toy")[1:]]
    subprocess.run(command, cwd=toy.folder, env=toy.environment(), check=True)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "overrides: [+toy=default]\nstages: {total: {stage: toy_total, config: [toy]}}\n",
            "takes 'roll', but its pipeline",
        ),
        ("stages: {roll: {stage: toy_roll, config: [learn, seed]}}\n", "does not take the nodes that its pipeline"),
    ],
)
def test_a_pipeline_that_does_not_fit_its_stage_is_reported_as_such(
    toy_beside_ours: ToyProject, text: str, message: str
) -> None:
    (toy_beside_ours.folder / "pipelines/odd.yaml").write_text(text)
    error = toy_beside_ours.kendama("run", "-p", "odd", expect=1).stderr
    assert message in error
    assert "(unexpected; " not in error


@portable_is_slow
@pytest.mark.usefixtures("each_way")
def test_force_runs_a_cached_stage_to_the_same_bytes(toy: ToyProject) -> None:
    before = toy.run_json()
    after = toy.run_json("--force", "roll")
    assert statuses(after) == {"roll": "ran", "total": "cached"}
    assert artifact_bytes(before) == artifact_bytes(after)


def test_until_stops_after_the_stage(toy: ToyProject) -> None:
    assert statuses(toy.run_json("--until", "roll")) == {"roll": "ran"}


@pytest.mark.parametrize("change", ["flip", "truncate", "delete"])
def test_a_damaged_artifact_is_found_and_recomputed_never_served(toy: ToyProject, change: str) -> None:
    before = toy.run_json()
    assert toy.kendama("cache", "verify").stdout == "every byte is as it was written\n"
    whole = artifact_bytes(before)
    file = Path(before["stages"][0]["artifact"]) / "arrays.npz"
    stamp = file.stat()
    data = bytearray(file.read_bytes())
    if change == "flip":
        data[len(data) // 2] ^= 1
        file.write_bytes(data)
        os.utime(file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    elif change == "truncate":
        file.write_bytes(data[:-1])
    else:
        file.unlink()
    found = toy.kendama("cache", "verify", expect=1)
    assert "arrays.npz" in found.stdout
    plan = json.loads(toy.kendama("plan", "-p", "toy", "--json").stdout)
    assert plan["stages"][0]["reasons"] == ["stored artifact damaged or missing"]
    after = toy.run_json()
    assert statuses(after)["roll"] == "ran"
    assert artifact_bytes(after) == whole
    toy.kendama("cache", "verify")


def test_every_flipped_byte_of_the_store_is_found(toy: ToyProject) -> None:
    toy.run_json()
    files = [file for file in toy.home.glob("objects/**/*") if file.is_file()]
    files += list(toy.home.glob("results/**/*.json"))
    assert len(files) >= 8
    for file in files:
        data = file.read_bytes()
        for place in {0, len(data) // 3, len(data) - 1}:
            damaged = bytearray(data)
            damaged[place] ^= 4
            file.write_bytes(damaged)
            assert verify(Store(toy.home)), f"{file} byte {place}"
        file.write_bytes(data)
    toy.kendama("cache", "verify")


@portable_is_slow
@pytest.mark.usefixtures("each_way")
def test_gc_removes_the_damaged_and_keeps_the_rest(toy: ToyProject) -> None:
    document = toy.run_json()
    (Path(document["stages"][0]["artifact"]) / "artifact.json").write_text("{}")
    toy.kendama("cache", "gc")
    toy.kendama("cache", "verify")
    assert statuses(toy.run_json()) == {"roll": "ran", "total": "cached"}


@portable_is_slow
@pytest.mark.usefixtures("each_way")
def test_an_idle_run_imports_nothing_heavy(toy: ToyProject) -> None:
    time.sleep(SETTLED_S + 0.1)  # what was written just now may change again within a clock's tick
    toy.run_json()
    probe = (
        "import sys; from kendama_cli.cli.main import main; code = main(['run', '-p', 'toy', '--json']);"
        "heavy = {'hydra', 'omegaconf', 'pandas', 'cv2', 'dartpy', 'numba', 'numpy', 'scipy'} & set(sys.modules);"
        "print(code, sorted(heavy), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", probe], cwd=toy.folder, env=toy.environment(), capture_output=True, text=True, check=True
    )
    assert done.stderr.splitlines()[-1] == "0 []"


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        (1, 12, "1 file -> 12 files"),
        (12, 1, "12 files -> 1 file"),
        (10_000, 10_001, "10000 files -> 10001 files"),
        (3, 2, "[0.csv@00000000, 1.csv@00000000, 2.csv@00000000] -> [0.csv@00000000, 1.csv@00000000]"),
    ],
)
def test_a_reason_that_lists_files_is_cut(before: int, after: int, told: str) -> None:
    def files(count: int) -> list[str] | str:
        named = [f"{number}.csv {'0' * 64}" for number in range(count)]
        return named if count > 1 else named[0]

    assert _changed(files(before), files(after)) == told


def test_a_reason_names_which_of_many_files_changed_and_no_value_runs_on() -> None:
    before = [f"{number}.csv {'0' * 64}" for number in range(10)]
    after = [*before[:4], f"4.csv {'1' * 64}", *before[5:]]
    assert _changed(before, after) == "1 of 10 files, 4.csv@11111111 first"
    assert len(_changed("a" * 10_000, list(range(10_000)))) < 500


def test_a_run_that_is_refused_before_anything_computes_is_no_run(toy: ToyProject) -> None:
    stage = toy.folder / "lib/toy/roll/stage.py"
    whole = stage.read_text()
    refusal = "from kendama_cli.errors import InputError\n        raise InputError('a', 'b')\n        rng = ctx.rng"
    stage.write_text(whole.replace("rng = ctx.rng", refusal))
    document = toy.run_json(expect=1)
    assert (document["outcome"], document["recorded"]) == ("failed", False)
    assert "nothing was computed, so it is not among the runs" in toy.kendama("run", "-p", "toy", expect=1).stdout
    assert json.loads(toy.kendama("runs", "--json").stdout) == []
    stage.write_text(whole)
    toy.run_json("toy.fail_at=3", expect=1)
    assert [run["outcome"] for run in json.loads(toy.kendama("runs", "--json").stdout)] == ["failed"]
