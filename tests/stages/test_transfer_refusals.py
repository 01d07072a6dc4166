"""Inputs that do not fit are refused by the transfer stage before anything moves."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory
from kendama_cli.artifacts.policy import NamedArray, PolicyArtifact
from kendama_cli.artifacts.transfer_result import TransferResult
from kendama_cli.errors import InputError, StageError
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.stages.transfer import stage as transfer_stage
from kendama_cli.store.codecs import save_artifact
from tests.identification.test_kept_servo import PLAIN, SERVO, logged
from tests.memory_context import MemoryContext
from tests.stages.transfer_setup import GAME, ROBOT, SAFETY, SHORT, stage


def test_a_motion_for_other_joints_is_refused(policy: PolicyArtifact, still: CatchMotion) -> None:
    joints = still.joints
    names = tuple(f"other_{k}" for k in range(len(joints.joint_names)))
    wrong = JointTrajectory(names, joints.t_s, joints.position_rad, joints.velocity_rad_s, joints.acceleration_rad_s2)
    settings = dataclasses.replace(SHORT, max_rollouts=1, games=1)
    with pytest.raises(StageError, match="the imitation motion is for the joints other_0"):
        stage(settings).run({"learn": policy, "adapt": dataclasses.replace(still, joints=wrong)}, MemoryContext(1))


def test_a_motion_is_played_only_where_it_and_its_seen_catch_are_safe(
    policy: PolicyArtifact, still: CatchMotion, nothing_moves: None
) -> None:
    """The plan lifts the cup by 20 mm in one place; the box beside it is too narrow for the smallest circle."""
    x = float(RobotModel(ROBOT, GAME.cup, GAME.gravity_m_s2).tool_position_m(still.joints.position_rad[0])[0])
    narrow = dataclasses.replace(SAFETY, cup_high_m=(x + 0.05, *SAFETY.cup_high_m[1:]))
    with pytest.raises(StageError, match=r"cup, x: from .*nothing was moved"):
        stage(SHORT, safety=narrow).run({"learn": policy, "adapt": still}, MemoryContext(1))
    for missing in ("adapt", "safety"):
        with pytest.raises(StageError, match=f"without the settings of '{missing}'; add '{missing}' to transfer's"):
            stage(SHORT, **{missing: None}).run({"learn": policy, "adapt": still}, MemoryContext(1))  # type: ignore[arg-type]


@pytest.fixture
def nothing_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    def moved(*_: object) -> None:
        raise AssertionError("the robot was opened")

    monkeypatch.setattr(transfer_stage, "open_robot", moved)


def _changed(policy: PolicyArtifact) -> PolicyArtifact:
    table = policy.array("q").copy()
    table[7, 2] += 1e-12
    return dataclasses.replace(policy, arrays=(NamedArray("q", table),))


def _other_goal(policy: PolicyArtifact) -> PolicyArtifact:
    meaning = json.loads(policy.meaning)
    meaning["goal"]["angle_deg"] = 120.0
    return PolicyArtifact.seal(policy.kind, meaning, {"q": policy.array("q")})


def _short(policy: PolicyArtifact) -> PolicyArtifact:
    return PolicyArtifact.seal(policy.kind, json.loads(policy.meaning), {"q": policy.array("q")[:-1]})


def _of_another_learner(policy: PolicyArtifact) -> PolicyArtifact:
    return PolicyArtifact.seal("random_replay", json.loads(policy.meaning), {"harmonic": np.zeros(3)})


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (_changed, "the policy of the stage 'learn' is damaged: its digest is"),
        (_short, r"cannot be acted by: the table has shape \(323, 5\); the configuration 'learn' needs \(324, 5\)"),
        (_other_goal, r"another configuration \(learn.goal.angle_deg is 130.0, it was 120.0\)"),
        (
            _of_another_learner,
            "is one of task 'easy', learned by 'random_replay'; the configuration has task 'easy' and lear",
        ),
        (lambda policy: PolicyArtifact.seal(policy.kind, {}, {"q": policy.array("q")}), "is one of task 'unknown'"),
    ],
    ids=["digest", "shape", "goal", "learner", "nothing"],
)
@pytest.mark.usefixtures("nothing_moves")
def test_a_policy_that_does_not_fit_is_refused_before_anything_moves(
    policy: PolicyArtifact, spoil: Any, says: str
) -> None:
    with pytest.raises(StageError, match=says) as caught:
        stage().run({"learn": spoil(policy)}, MemoryContext(0))
    assert "nothing was moved" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.usefixtures("nothing_moves")
def test_a_table_from_a_file_is_verified_the_same_way(policy: PolicyArtifact, tmp_path: Path) -> None:
    save_artifact(PolicyArtifact, policy, tmp_path)
    settings = dataclasses.replace(SHORT, policy=str(tmp_path / "artifact.json"))
    with pytest.raises(AssertionError, match="the robot was opened"):
        stage(settings).run({}, MemoryContext(0))
    save_artifact(PolicyArtifact, _changed(policy), tmp_path)
    with pytest.raises(StageError, match=r"artifact\.json is damaged"):
        stage(settings).run({}, MemoryContext(0))


@pytest.mark.usefixtures("nothing_moves")
def test_a_servo_of_another_arm_is_refused(still: CatchMotion, tmp_path: Path) -> None:
    settings = {**PLAIN, "hardware": {"kind": "mujoco"}}
    log = logged(tmp_path / "log.mcap", "transfer", settings, SERVO)
    with pytest.raises(StageError, match=r"transfer\.servo is of .* on mujoco, and this arm is .* nothing was moved"):
        stage(dataclasses.replace(SHORT, servo=log)).run({"adapt": still}, MemoryContext(0))


@pytest.mark.parametrize("content", [b"", b"{}", b'{"kind": "PolicyArtifact", "body": {}}', b"\xff\xfe\x00"])
@pytest.mark.usefixtures("nothing_moves")
def test_a_file_that_holds_no_policy_is_one_clear_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "artifact.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match="holds no policy") as caught:
        stage(dataclasses.replace(SHORT, policy=str(path))).run({}, MemoryContext(0))
    assert "\n" not in str(caught.value)


@pytest.mark.usefixtures("nothing_moves")
def test_with_neither_motion_nor_policy_there_is_nothing_to_play() -> None:
    with pytest.raises(StageError, match=r"neither the motion of 'adapt' nor the policy of 'learn'.*nothing was moved"):
        stage().run({}, MemoryContext(0))


@pytest.mark.usefixtures("nothing_moves")
def test_the_result_of_an_imitation_alone_holds_no_policy(tmp_path: Path) -> None:
    save_artifact(TransferResult, TransferResult(None, 0, True, 0, 0), tmp_path)
    settings = dataclasses.replace(SHORT, policy=str(tmp_path / "artifact.json"))
    with pytest.raises(InputError, match=r"holds no policy .*the transfer had none"):
        stage(settings).run({}, MemoryContext(0))


@pytest.mark.usefixtures("nothing_moves")
def test_a_motion_without_the_settings_that_made_it_is_refused_before_anything_moves(
    policy: PolicyArtifact, still: CatchMotion
) -> None:
    with pytest.raises(StageError, match="add 'adapt' to transfer's config in the pipeline; nothing was moved"):
        stage(adapt=None).run({"learn": policy, "adapt": still}, MemoryContext(0))
