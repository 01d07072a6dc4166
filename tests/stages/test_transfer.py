"""The transfer stage with a twin process of its own: it plays, it can be killed, and it refuses what does not fit."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory, MotionPlan
from kendama_cli.artifacts.policy import NamedArray, PolicyArtifact
from kendama_cli.errors import HardwareError, InputError, StageError
from kendama_cli.game.settings import TransferSettings
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.camera import CameraSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings, TwinHardware
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.catch.settings import AdaptSettings
from kendama_cli.simulation.placement.find_placement import current_placement
from kendama_cli.simulation.placement.placement import joint_trajectory
from kendama_cli.stages.interface import Made
from kendama_cli.stages.learn.stage import Learn
from kendama_cli.stages.transfer import stage as transfer_stage
from kendama_cli.stages.transfer.stage import Transfer
from kendama_cli.store.codecs import save_artifact
from kendama_cli.vision.settings import PredictSettings
from tests.learning.settings_files import learn_settings
from tests.memory_context import MemoryContext
from tests.shipped_conf import plain
from tests.simulation.dart.bench_robot import adapt_values

ROOT = Path(__file__).resolve().parents[2]


def configured(schema: Any, group: str, name: str) -> Any:
    document = plain(group, name)
    if group == "robot":
        document["path"] = str(ROOT / document["path"])
    return build_value(schema, document, group)


GAME: GameSettings = configured(GameSettings, "game", "kendama")
ROBOT: RobotSettings = configured(RobotSettings, "robot", "pa10")
TWIN: TwinHardware = configured(HardwareSettings, "hardware", "twin")
LEARN: LearnSettings = learn_settings()
CAMERA: CameraSettings = configured(CameraSettings, "camera", "virtual")
LIGHTING: LightingSettings = configured(LightingSettings, "lighting", "bright")
PREDICT: PredictSettings = configured(PredictSettings, "predict", "flights")
ADAPT: AdaptSettings = build_value(AdaptSettings, adapt_values(), "adapt")
FULL: TransferSettings = configured(TransferSettings, "transfer", "default")
SHORT = dataclasses.replace(FULL, evaluation_n=1, cap=2, games=3, imitation_tries=2, baseline=True)


@pytest.fixture(scope="module")
def policy() -> PolicyArtifact:
    quick = dataclasses.replace(LEARN, count=dataclasses.replace(LEARN.count, evaluation=1))
    made: PolicyArtifact = Learn(learn=quick, game=GAME).run({}, MemoryContext(0)).artifact
    return made


@pytest.fixture(scope="module")
def still() -> CatchMotion:
    """A motion of half a second that only lifts the cup a little: it never catches."""
    t_s = np.arange(126) * 0.004
    lift = np.column_stack([np.zeros_like(t_s), np.zeros_like(t_s), 0.02 * np.sin(np.pi * t_s / 0.5) ** 2])
    joints = joint_trajectory(RobotModel(ROBOT, GAME.cup, GAME.gravity_m_s2), t_s, lift)
    one, two = np.zeros(1), np.ones(2)
    plan = MotionPlan(("z",), 0.5, 1.0, 100.0, 2.0, one, one, one, one, np.zeros((1, 2)), two, two, np.zeros((0, 6)))
    return CatchMotion(plan, joints, current_placement(RobotModel(ROBOT, GAME.cup, GAME.gravity_m_s2)), False, 0.0)


def stage(settings: TransferSettings = SHORT, hardware: HardwareSettings = TWIN) -> Transfer:
    return Transfer(
        transfer=settings,
        hardware=hardware,
        robot=ROBOT,
        game=GAME,
        learn=LEARN,
        camera=CAMERA,
        lighting=LIGHTING,
        predict=PREDICT,
        adapt=ADAPT,
    )


def same(one: Made, ctx: MemoryContext, other: Made, other_ctx: MemoryContext) -> bool:
    return (
        one.artifact.policy.digest == other.artifact.policy.digest
        and dict(one.metrics) == dict(other.metrics)
        and log_bytes(ctx) == log_bytes(other_ctx)
    )


def log_bytes(ctx: MemoryContext) -> bytes:
    return repr(ctx.log.messages).encode()


@pytest.fixture(scope="module")
def uninterrupted(policy: PolicyArtifact, still: CatchMotion) -> tuple[Made, MemoryContext]:
    ctx = MemoryContext(3)
    return stage().run({"learn": policy, "adapt": still}, ctx), ctx


def twins() -> list[int]:
    found = []
    for children in Path("/proc/self/task").glob("*/children"):
        for pid in children.read_text().split():
            if b"twin_process" in Path(f"/proc/{pid}/cmdline").read_bytes():
                found.append(int(pid))
    return found


def test_the_stage_reports_what_was_asked_for(uninterrupted: tuple[Made, MemoryContext]) -> None:
    made, _ = uninterrupted
    for name in (
        "rollouts",
        "success_rate_before",
        "success_rate_after",
        "imitation_caught",
        "games",
        "caught_rate",
        "missed_packets",
    ):
        assert name in made.metrics
    assert made.metrics["rollouts_from_scratch"] == 2, "the cap, as it did not learn"
    assert made.metrics["learned_from_scratch"] is False
    assert made.metrics["games"] == 3
    assert 0.0 < float(made.metrics["latency_frames_p95"] or 0.0) <= 1.0, "from mid-exposure to the command"
    assert float(made.metrics["seen_rate"] or 0.0) >= 0.95
    assert made.metrics["missed_packets"] == 0
    assert made.metrics["imitation_caught"] is False
    assert made.metrics["imitation_tries"] == 2
    assert made.artifact.policy.meaning


def test_times_do_not_go_back_on_any_topic(uninterrupted: tuple[Made, MemoryContext]) -> None:
    _, ctx = uninterrupted
    last: dict[str, float] = {}
    for topic, t_s, _ in ctx.log.messages:
        assert t_s >= last.get(topic, 0.0), topic
        last[topic] = t_s
    assert set(last) >= {
        "/transfer/step",
        "/transfer/rollout",
        "/transfer/scratch/rollout",
        "/transfer/joints",
        "/transfer/cup",
        "/transfer/ball",
        "/transfer/game",
        "/transfer/detection",
        "/transfer/estimate",
        "/transfer/image/left",
        "/transfer/image/right",
        "/transfer/imitation/cup",
        "/transfer/imitation/ball",
    }


def test_the_log_says_how_each_game_was_seen_and_how_it_ended(uninterrupted: tuple[Made, MemoryContext]) -> None:
    made, ctx = uninterrupted
    games = [message for topic, _, message in ctx.log.messages if topic == "/transfer/game"]
    assert [game.index for game in games] == [0, 1, 2]
    assert sum(game.outcome == "caught" for game in games) == made.artifact.caught
    replays = [message for topic, _, message in ctx.log.messages if topic == "/transfer/replay"]
    twins_rope_m = TWIN.imperfection.rope_scale * GAME.rope.length_m
    assert [one.rope_m for one in replays] == pytest.approx([twins_rope_m] * 3, abs=1e-6)
    estimates = [message for topic, _, message in ctx.log.messages if topic == "/transfer/estimate"]
    for number, game in enumerate(games):
        of_game = [one for one in estimates if one.game == number]
        spread = [np.trace(np.reshape(one.covariance_m2, (3, 3))) for one in of_game]
        assert spread[-1] < 0.01 * spread[0], "every frame adds to what is known"
        seen = [one for topic, _, one in ctx.log.messages if topic == "/transfer/detection" and one.flight == number]
        assert game.frames == len(seen)
        assert game.seen == sum(one.seen for one in seen)


def test_without_cameras_the_marker_is_followed(policy: PolicyArtifact) -> None:
    tracked = dataclasses.replace(FULL.observation, source="tracking")
    settings = dataclasses.replace(SHORT, cap=1, games=1, baseline=False, observation=tracked)
    ctx = MemoryContext(1)
    made = stage(settings).run({"learn": policy}, ctx)
    assert made.metrics["latency_frames_p95"] is None
    assert made.metrics["seen_rate"] is None
    assert any(topic == "/transfer/estimate" for topic, _, _ in ctx.log.messages)
    assert not any(topic == "/transfer/detection" for topic, _, _ in ctx.log.messages)


def test_no_twin_is_left_behind(uninterrupted: tuple[Made, MemoryContext]) -> None:
    assert not twins()


def test_killed_time_and_again_and_resumed_equals_uninterrupted(
    policy: PolicyArtifact, still: CatchMotion, uninterrupted: tuple[Made, MemoryContext]
) -> None:
    killed: MemoryContext | None = None
    points = [1, 4, 5, 8, 10]
    for further in np.diff(points, prepend=0):
        killed = MemoryContext(3, stop_after=int(further), resume_from=killed)
        with pytest.raises(KeyboardInterrupt):
            stage().run({"learn": policy, "adapt": still}, killed)
    assert uninterrupted[1].checkpoints > points[-1]
    resumed = MemoryContext(3, resume_from=killed)
    made = stage().run({"learn": policy, "adapt": still}, resumed)
    assert same(made, resumed, *uninterrupted)


class KillsTheTwin(MemoryContext):
    """Kills the twin's process as soon as ``after`` rollouts are done."""

    def __init__(self, seed: int, after: int) -> None:
        super().__init__(seed)
        self.after = after

    def progress(self, done: int, total: int | None, **figures: float | int | str) -> None:
        if done == self.after:
            for pid in twins():
                os.kill(pid, signal.SIGKILL)


def test_what_was_learned_before_the_twin_died_is_kept_and_gone_on_from(
    policy: PolicyArtifact, still: CatchMotion, uninterrupted: tuple[Made, MemoryContext]
) -> None:
    broken = KillsTheTwin(3, after=2)
    with pytest.raises(HardwareError) as caught:
        stage().run({"learn": policy, "adapt": still}, broken)
    assert "the twin's process was killed by signal 9" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert broken.saved is not None
    assert broken.saved[0]["table"]["count"]["rollouts"] == 1
    resumed = MemoryContext(3, resume_from=broken)
    made = stage().run({"learn": policy, "adapt": still}, resumed)
    assert same(made, resumed, *uninterrupted)


def test_without_an_imitation_motion_nothing_is_said_about_it(policy: PolicyArtifact) -> None:
    settings = dataclasses.replace(SHORT, cap=1, games=1, baseline=False)
    made = stage(settings).run({"learn": policy}, MemoryContext(1))
    assert made.metrics["imitation_caught"] is None
    assert "rollouts_from_scratch" not in made.metrics


def test_a_motion_for_other_joints_is_refused(policy: PolicyArtifact, still: CatchMotion) -> None:
    joints = still.joints
    names = tuple(f"other_{k}" for k in range(len(joints.joint_names)))
    wrong = JointTrajectory(names, joints.t_s, joints.position_rad, joints.velocity_rad_s, joints.acceleration_rad_s2)
    settings = dataclasses.replace(SHORT, cap=1, games=1)
    with pytest.raises(StageError, match="the imitation motion is for the joints other_0"):
        stage(settings).run({"learn": policy, "adapt": dataclasses.replace(still, joints=wrong)}, MemoryContext(1))


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
    return PolicyArtifact.seal("harmonic_search", json.loads(policy.meaning), {"harmonic": np.zeros(3)})


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (_changed, "the policy of the stage 'learn' is damaged: its digest is"),
        (_short, r"cannot be acted by: the table has shape \(323, 5\); the configuration 'learn' needs \(324, 5\)"),
        (_other_goal, r"another configuration \(learn.goal.angle_deg is 130.0, it was 120.0\)"),
        (_of_another_learner, "is one of learner 'harmonic_search'; the configuration has learn.learner.kind 'table'"),
        (lambda policy: PolicyArtifact.seal(policy.kind, {}, {"q": policy.array("q")}), "another configuration"),
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


@pytest.mark.parametrize("content", [b"", b"{}", b'{"kind": "PolicyArtifact", "body": {}}', b"\xff\xfe\x00"])
@pytest.mark.usefixtures("nothing_moves")
def test_a_file_that_holds_no_policy_is_one_clear_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "artifact.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match="holds no policy") as caught:
        stage(dataclasses.replace(SHORT, policy=str(path))).run({}, MemoryContext(0))
    assert "\n" not in str(caught.value)


def test_the_default_games_on_the_default_twin_are_caught(policy: PolicyArtifact) -> None:
    """119 of 120 games over twelve fresh seeds were caught: at that rate fewer than 5 of 6 come once in 1000 times."""
    settings = dataclasses.replace(FULL, evaluation_n=1, cap=1, games=6)
    made = stage(settings).run({"learn": policy}, MemoryContext(11))
    assert float(made.metrics["caught_rate"] or 0.0) >= 5 / 6


@pytest.mark.usefixtures("nothing_moves")
def test_a_motion_without_the_settings_that_made_it_is_refused_before_anything_moves(
    policy: PolicyArtifact, still: CatchMotion
) -> None:
    bare = Transfer(
        transfer=SHORT,
        hardware=TWIN,
        robot=ROBOT,
        game=GAME,
        learn=LEARN,
        camera=CAMERA,
        lighting=LIGHTING,
        predict=PREDICT,
    )
    with pytest.raises(StageError, match="add 'adapt' to transfer's config in the pipeline; nothing was moved"):
        bare.run({"learn": policy, "adapt": still}, MemoryContext(0))
