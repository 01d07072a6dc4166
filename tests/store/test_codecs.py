"""Every artifact comes back from its files as it was, and equal artifacts are equal bytes."""

from __future__ import annotations

import dataclasses
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration, DemonstrationSet
from kendama_cli.artifacts.friction_model import FrictionModel, NetworkFriction, ParametricFriction
from kendama_cli.artifacts.kendama_model import KendamaModel
from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory, MotionPlan
from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.artifacts.prediction import PredictionStudy
from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.artifacts.transfer_result import TransferResult
from kendama_cli.errors import StageError, StoreError
from kendama_cli.schema.declaration import find_stage, stage_names
from kendama_cli.settings.placement import Placement
from kendama_cli.store.codecs import load_artifact, save_artifact

RNG = np.random.default_rng(0)
PLAN = MotionPlan(
    coordinates=("x", "z"),
    duration_s=1.5,
    tau_scale=0.9,
    stiffness=1000.0,
    phase_decay=2.0,
    start_m=RNG.normal(size=2),
    start_velocity_m_s=RNG.normal(size=2),
    goal_m=RNG.normal(size=2),
    goal_velocity_m_s=RNG.normal(size=2),
    weights=RNG.normal(size=(2, 20)),
    centers=np.linspace(1, 0.1, 20),
    widths=np.full(20, 0.1),
    variation=RNG.normal(size=(2, 47)),
)
JOINTS = JointTrajectory(("a", "b"), np.arange(5.0), *(RNG.normal(size=(5, 2)) for _ in range(3)))
POLICY = PolicyArtifact.seal("table", {"gamma": 0.95}, {"q": RNG.normal(size=(324, 5)), "bias": RNG.normal(size=5)})
PLACEMENT = Placement((0.1, 0.2, 0.3), 0.4, (0.5, 0.6), (0.0, 0.0, 0.3), (1.0, 0.0, 0.0), (1.0, 2.0))
EXAMPLES: list[Any] = [
    DemonstrationSet(tuple(Demonstration(f"d{i}", np.arange(4.0), RNG.normal(size=(4, 3))) for i in range(3))),
    PLAN,
    CatchMotion(plan=PLAN, joints=JOINTS, placement=PLACEMENT, caught=True, success_rate=0.9),
    FrictionModel(
        joint_names=("a", "b"),
        chosen="network",
        parametric=ParametricFriction(*RNG.uniform(0.1, 1.0, (5, 2))),
        network=NetworkFriction(RNG.normal(size=(2, 4, 3)), RNG.normal(size=(2, 5))),
        max_speed_rad_s=np.ones(2),
        parametric_rms_nm=np.full(2, 0.2),
        network_rms_nm=np.full(2, 0.1),
        servo=ServoModel(("a", "b"), 0.01, *RNG.uniform(0.0, 0.1, (4, 2))),
    ),
    POLICY,
    PredictionStudy(np.array([0.5]), *(RNG.normal(size=(3, 1)) for _ in range(3))),
    KendamaModel(0.4, 1e-4, 1e-4, 4e-4, np.array([[1e-10, -2e-11], [-2e-11, 1e-11]]), 1.1, 32.0, 0.002),
    TransferResult(policy=POLICY, rollouts=4, imitation_caught=None, games=3, caught=2),
]


def same(one: Any, other: Any) -> bool:
    if dataclasses.is_dataclass(one):
        return type(one) is type(other) and all(
            same(getattr(one, field.name), getattr(other, field.name)) for field in dataclasses.fields(one)
        )
    if isinstance(one, np.ndarray):
        return isinstance(other, np.ndarray) and one.dtype == other.dtype and np.array_equal(one, other)
    if isinstance(one, tuple):
        return isinstance(other, tuple) and len(one) == len(other) and all(map(same, one, other))
    return type(one) is type(other) and bool(one == other)


def test_what_every_stage_of_the_core_gives_has_an_example() -> None:
    targets = {stage.returns for name in stage_names() if (stage := find_stage(name))}
    declared = {target.partition(":")[2] for target in targets if not target.startswith("kendama_cli.plugins.")}
    assert {type(example).__name__ for example in EXAMPLES} == declared


@pytest.mark.parametrize("artifact", EXAMPLES, ids=lambda item: type(item).__name__)
def test_an_artifact_comes_back_as_it_was_and_twice_to_the_same_bytes(artifact: Any, tmp_path: Path) -> None:
    files = []
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        save_artifact(type(artifact), artifact, folder)
        files.append({file.name: file.read_bytes() for file in folder.iterdir()})
    assert files[0] == files[1]
    assert same(load_artifact(type(artifact), tmp_path / "one"), artifact)


def test_no_artifact_needs_pickle_or_carries_a_date(tmp_path: Path) -> None:
    save_artifact(MotionPlan, PLAN, tmp_path)
    with zipfile.ZipFile(tmp_path / "arrays.npz") as archive:
        assert {member.date_time for member in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        for name in archive.namelist():
            np.lib.format.read_array(archive.open(name), allow_pickle=False)


@dataclasses.dataclass(frozen=True)
class Stranger:
    value: int


def test_something_else_than_declared_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(StageError) as caught:
        save_artifact(PolicyArtifact, Stranger(1), tmp_path, "stage 'learn'")
    assert str(caught.value) == "stage 'learn' returned a Stranger; its declaration says PolicyArtifact"
    assert not list(tmp_path.iterdir())


def test_who_reads_an_artifact_says_what_it_must_be(tmp_path: Path) -> None:
    save_artifact(Stranger, Stranger(1), tmp_path)
    with pytest.raises(
        StoreError,
        match=r"cannot read the PolicyArtifact in .*a PolicyArtifact has the fields arrays, digest, kind, meaning",
    ):
        load_artifact(PolicyArtifact, tmp_path)


@pytest.mark.parametrize("file", ["artifact.json", "arrays.npz"])
def test_an_unreadable_artifact_names_its_folder(tmp_path: Path, file: str) -> None:
    save_artifact(MotionPlan, PLAN, tmp_path)
    (tmp_path / file).write_bytes(b"rubbish")
    with pytest.raises(StoreError, match=str(tmp_path)):
        load_artifact(MotionPlan, tmp_path)
