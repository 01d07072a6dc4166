from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import yaml

from kendama_cli.artifacts.friction_model import FrictionModel
from kendama_cli.errors import StageError
from kendama_cli.plugins.identification.friction_stage import Identify
from kendama_cli.plugins.identification.settings import IdentifySettings
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import TwinHardware
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.stages.interface import StageResult
from tests.memory_context import MemoryContext
from tests.simulation.dart.bench_robot import bench_arm, kendama_game

CONF = Path(__file__).parents[3] / "conf"
SHIPPED = build(IdentifySettings, yaml.safe_load((CONF / "identify/sweep.yaml").read_text()), "identify")
QUICK = dataclasses.replace(SHIPPED, duration_s=8.0, held_out_s=5.0, hidden_units=3, tracking_laps=1)
TWIN = build(TwinHardware, yaml.safe_load((CONF / "hardware/twin.yaml").read_text()), "hardware")
ONLY_FRICTION = yaml.safe_load((CONF / "hardware/worn.yaml").read_text())["imperfection"]
WORN = dataclasses.replace(TWIN, imperfection=dataclasses.replace(TWIN.imperfection, **ONLY_FRICTION))


def run(
    settings: IdentifySettings = QUICK,
    hardware: TwinHardware = WORN,
    robot: RobotSettings | None = None,
    ctx: MemoryContext | None = None,
    game: GameSettings | None = None,
) -> StageResult:
    stage = Identify(identify=settings, hardware=hardware, robot=robot or bench_arm(), game=game or kendama_game())
    return stage.run({}, ctx or MemoryContext(seed=3))


@pytest.fixture(scope="module")
def context() -> MemoryContext:
    return MemoryContext(seed=3)


@pytest.fixture(scope="module")
def made(context: MemoryContext) -> StageResult:
    return run(ctx=context)


def test_half_a_newton_metre_that_nobody_modelled_is_found_and_the_cup_follows_within_a_millimetre(
    made: StageResult,
) -> None:
    model = made.artifact
    assert isinstance(model, FrictionModel)
    assert model.parametric.coulomb_nm == pytest.approx(np.full(7, 0.5), abs=0.06)
    before, after = (float(made.metrics[f"tracking_rms_mm_{when}"] or 0) for when in ("before", "after"))
    assert made.metrics["tracking_speed_m_s"] == 1.0
    assert after < 1.0
    assert after < before
    assert made.metrics["model"] == model.chosen
    assert {f"{name}_rms_nm" for name in model.joint_names} <= set(made.metrics)


def test_the_servos_lag_is_found_and_an_arm_that_follows_has_none(made: StageResult) -> None:
    assert made.metrics["servo_lag_s"] == 0.0
    late = dataclasses.replace(WORN, imperfection=dataclasses.replace(WORN.imperfection, lag_s=0.06, latency_s=0.008))
    found = run(dataclasses.replace(QUICK, duration_s=5.0, held_out_s=3.0, hidden_units=1), late)
    assert found.artifact.servo.delay_s == pytest.approx(0.068, abs=0.004)
    assert found.metrics["servo_lag_s"] == float(np.median(found.artifact.servo.lag_s))


def test_the_log_tells_of_the_motion_the_friction_and_the_circle(context: MemoryContext, made: StageResult) -> None:
    topics = {topic for topic, _, _ in context.log.messages}
    assert topics == {f"/identify/{name}" for name in ("joints", "wrench", "friction", "servo")} | {
        f"/identify/tracking/{name}" for name in ("reference", "before", "after")
    }
    joints = {message.joint for topic, _, message in context.log.messages if topic == "/identify/friction"}
    assert joints == set(made.artifact.joint_names)


@pytest.mark.slow
def test_a_killed_and_resumed_identification_ends_as_an_uninterrupted_one(
    context: MemoryContext, made: StageResult
) -> None:
    killed = MemoryContext(seed=3, stop_after=2)
    with pytest.raises(KeyboardInterrupt):
        run(ctx=killed)
    resumed = MemoryContext(seed=3, resume_from=killed)
    again = run(ctx=resumed)
    assert again.metrics == made.metrics
    assert np.array_equal(again.artifact.network.hidden, made.artifact.network.hidden)
    resumed_log, whole_log = ([(topic, t_s) for topic, t_s, _ in one.log.messages] for one in (resumed, context))
    assert resumed_log == whole_log


def test_a_joint_without_the_room_to_be_excited_is_named_before_anything_moves() -> None:
    with pytest.raises(
        StageError, match=r"cannot be excited by 9.0 rad both ways; allowed: .* lower identify.amplitude"
    ):
        run(dataclasses.replace(QUICK, amplitude_rad=9.0))


def test_a_motion_that_shows_too_little_names_the_joint() -> None:
    with pytest.raises(StageError, match=r"moved too little to identify its friction: .* raise identify.duration_s"):
        run(dataclasses.replace(QUICK, amplitude_rad=1e-3, duration_s=2.0, held_out_s=2.0))


@pytest.mark.slow
@pytest.mark.parametrize("friction_nm", [0.2, 2.0])
def test_whatever_the_friction_a_soft_arm_follows_as_if_there_were_none(friction_nm: float) -> None:
    """With a ball of one gram: one of 50 g pulls a soft arm 2.8 mm off its circle, with friction and without."""
    game = kendama_game()
    ball = dataclasses.replace(game.ball, mass_kg=0.001)
    rope = dataclasses.replace(game.rope, stiffness_n_m=40.0, damping_n_s_m=0.04)
    hardware = dataclasses.replace(
        WORN, imperfection=dataclasses.replace(WORN.imperfection, joint_friction_nm=friction_nm)
    )
    made = run(
        SHIPPED,
        hardware,
        dataclasses.replace(bench_arm(), stiffness_1_s2=400.0),
        game=dataclasses.replace(game, ball=ball, rope=rope),
    )
    before, after = (float(made.metrics[f"tracking_rms_mm_{when}"] or 0) for when in ("before", "after"))
    assert before > 10 * friction_nm
    assert after < 0.2


@pytest.mark.slow
def test_noise_lag_and_latency_of_the_shipped_twin_hide_the_friction_from_no_joint() -> None:
    made = run(SHIPPED, TWIN)
    before, after = (float(made.metrics[f"tracking_rms_mm_{when}"] or 0) for when in ("before", "after"))
    assert after < min(before, 1.0)
    # the readings' noise of 0.2 mrad, differentiated twice, is 3 Nm at the strong joints of the base
    assert made.artifact.parametric.coulomb_nm == pytest.approx(np.full(7, 0.5), abs=0.25)
    assert made.artifact.parametric.coulomb_nm[4:] == pytest.approx(np.full(3, 0.5), abs=0.03)
    assert float(made.metrics["drive_delay_ms"] or 0) == pytest.approx(25.0, abs=2.0)  # lag 15 ms, latency 10 ms
