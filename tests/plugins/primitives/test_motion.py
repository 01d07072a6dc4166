"""``kendama motion``: a primitive goes out of the store, to a file, and back into a pipeline."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import DemonstrationSet
from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory, MotionPlan, holds_primitive, primitive_of
from kendama_cli.cli.main import main
from kendama_cli.devices.demonstrator.plan_file import read_plan
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.settings.placement import Placement
from kendama_cli.store import durable
from kendama_cli.store.codecs import save_artifact
from kendama_cli.store.home import record_path
from tests.motion.swings import demonstration, settings


@pytest.fixture(scope="module")
def plan() -> MotionPlan:
    return encode_demonstrations([demonstration(1.8 + 0.1 * i) for i in range(4)], settings())


@pytest.fixture
def home(tmp_path: Path, plan: MotionPlan) -> Path:
    """A home with one run whose pipeline has encode and adapt under names of its own."""
    joints = JointTrajectory(("a",), np.arange(5.0), *np.zeros((3, 5, 1)))
    placement = Placement((0.0, 0.0, 0.0), 0.0, (0.0,), (0.0, 0.0, 0.3), (1.0, 0.0, 0.0), (1.0,))
    catch = CatchMotion(plan=plan, joints=joints, placement=placement, caught=True, success_rate=1.0)
    stages = []
    for name, artifact in (("encode", plan), ("adapt", catch)):
        folder = tmp_path / name
        folder.mkdir()
        save_artifact(type(artifact), artifact, folder)
        stages.append({"name": f"{name}-mine", "stage": name, "artifact": str(folder)})
    record = {"run": "20260101-120000-abcdef", "pipeline": "imitation", "overrides": [], "outcome": "done"}
    home = tmp_path / "home"
    durable.write_sealed(record_path(home, record["run"]), {**record, "stages": stages, "started": "2026"})
    return home


def motion(home: Path, *arguments: str) -> int:
    return main(["motion", *arguments, "--home", str(home)])


def same(one: MotionPlan, other: MotionPlan) -> bool:
    return np.array_equal(one.weights, other.weights) and np.array_equal(one.variation, other.variation)


@pytest.mark.parametrize("name", ["swing.yaml", "swing.json", "swing.yml"])
@pytest.mark.parametrize("source", [[], ["20260101"], ["--stage", "adapt-mine"]], ids=["newest", "run", "adapt"])
def test_what_is_exported_is_what_was_stored(
    home: Path, tmp_path: Path, plan: MotionPlan, name: str, source: list[str]
) -> None:
    assert motion(home, "export", *source, "-o", str(tmp_path / name)) == 0
    assert same(read_plan(str(tmp_path / name)), plan)


def test_a_newer_run_without_a_primitive_is_passed_over_unless_it_is_named(
    home: Path, tmp_path: Path, plan: MotionPlan, capsys: pytest.CaptureFixture[str]
) -> None:
    newer = "20260102-120000-abcdef"
    record = {"run": newer, "pipeline": "press", "overrides": [], "outcome": "done", "stages": []}
    durable.write_sealed(record_path(home, newer), {**record, "started": "2026"})
    assert motion(home, "export", "-o", str(tmp_path / "swing.yaml")) == 0
    assert same(read_plan(str(tmp_path / "swing.yaml")), plan)
    capsys.readouterr()
    assert motion(home, "export", newer, "-o", str(tmp_path / "swing.yaml")) == 2
    assert f"the run {newer} has no primitive;" in capsys.readouterr().err


def test_an_artifacts_folder_and_a_file_are_sources_too(home: Path, tmp_path: Path, plan: MotionPlan) -> None:
    assert motion(home, "export", str(tmp_path / "encode"), "-o", str(tmp_path / "one.json")) == 0
    assert motion(home, "export", str(tmp_path / "one.json"), "-o", str(tmp_path / "two.yaml")) == 0
    assert same(read_plan(str(tmp_path / "two.yaml")), plan)


def test_show_tells_the_parameters(home: Path, plan: MotionPlan, capsys: pytest.CaptureFixture[str]) -> None:
    assert motion(home, "show", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["duration_s"] == plan.duration_s
    assert told["n_parameters"] == 22
    assert [row["coordinate"] for row in told["coordinates"]] == ["x", "y", "z"]
    assert motion(home, "show") == 0
    assert "goal velocity [m/s]" in capsys.readouterr().out


def test_sample_draws_as_many_as_asked_and_the_same_for_a_seed(home: Path, tmp_path: Path, plan: MotionPlan) -> None:
    for name in ("a", "b"):
        assert motion(home, "sample", "-n", "2", "--seed", "3", "-o", str(tmp_path / f"{name}.yaml")) == 0
    first, second, again = (read_plan(str(tmp_path / f"{name}.yaml")) for name in ("a-1", "a-2", "b-1"))
    assert same(first, again)
    assert not same(first, second)
    assert not same(first, plan)


def test_a_strangers_artifact_with_a_plan_carries_a_primitive_and_others_do_not(plan: MotionPlan) -> None:
    stranger = dataclasses.make_dataclass("Tuned", [("plan", MotionPlan), ("gain", float)], frozen=True)
    assert holds_primitive(stranger)
    assert same(primitive_of(stranger(plan, 1.0)), plan)
    assert not holds_primitive(DemonstrationSet)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["export", "nosuch"], "no run 'nosuch'; the newest is "),
        (["export", "--stage", "learn"], "have no primitive of stage 'learn'; name another run or --stage"),
        (["export", "-o", "swing.txt"], "swing.txt: ends in '.txt'; name it FILE.yaml, FILE.yml or FILE.json"),
        (["show", "nosuch.yaml"], "nosuch.yaml: cannot be read (No such file or directory)"),
    ],
)
def test_what_cannot_be_done_is_told_in_one_line(
    home: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], told: str
) -> None:
    assert motion(home, *arguments) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1


def test_nothing_is_drawn_from_one_demonstration(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "alone"
    folder.mkdir()
    save_artifact(MotionPlan, encode_demonstrations([demonstration()], settings()), folder)
    assert motion(home, "sample", str(folder)) == 2
    assert "comes from one demonstration, so nothing varies" in capsys.readouterr().err
    assert motion(home, "show", str(folder)) == 0


def test_a_result_that_is_no_primitive_is_told(home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "capture"
    folder.mkdir()
    save_artifact(DemonstrationSet, DemonstrationSet((demonstration(),)), folder)
    assert motion(home, "show", str(folder)) == 2
    assert "holds no primitive that can be read; name the artifact of a stage that gives one" in capsys.readouterr().err
