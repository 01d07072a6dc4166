"""The Python interface: what is exported, what it costs to import, and what it gives."""

from __future__ import annotations

import inspect
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kendama_cli as kendama
from kendama_cli import api
from kendama_cli.errors import ConfigError, StageError, UsageError
from tests.toy_project import ToyProject


def test_the_package_exports_what_the_interface_exports_and_nothing_else() -> None:
    assert set(kendama.__all__) == {*api.__all__, "__version__"}
    for name in api.__all__:
        assert getattr(kendama, name) is getattr(api, name)
    with pytest.raises(AttributeError, match="no attribute 'ran'"):
        kendama.ran  # noqa: B018


def test_importing_the_package_loads_nothing_of_it() -> None:
    code = "import sys, kendama_cli; print([name for name in sys.modules if name.startswith('kendama_cli.')])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


@pytest.mark.parametrize("name", [name for name in api.__all__ if inspect.isfunction(getattr(api, name))])
def test_every_function_is_documented_in_numpydoc_with_each_of_its_parameters(name: str) -> None:
    function = getattr(api, name)
    text = inspect.getdoc(function) or ""
    parameters = inspect.signature(function).parameters
    if parameters:
        assert "Parameters\n----------" in text
    for parameter in parameters:
        assert f"{parameter} :" in text or f"{parameter}," in text or f", {parameter} :" in text, parameter
    assert "Returns\n-------" in text
    assert "Raises\n------" in text or name == "play", "play takes any instants"


@pytest.mark.parametrize(
    "method",
    [
        api.Run.metrics,
        api.Run.folder,
        api.Run.artifact,
        api.Run.log,
        api.Run.report,
        api.LogFile.table,
        api.CatchPoseEstimator.update_pixels,
        api.CatchPoseEstimator.update_position,
        api.CatchPoseEstimator.catch,
    ],
    ids=lambda method: method.__qualname__,
)
def test_the_methods_that_the_page_on_the_interface_names_are_documented_alike(method: Callable[..., object]) -> None:
    text = inspect.getdoc(method) or ""
    for parameter in list(inspect.signature(method).parameters)[1:]:
        assert f"\n{parameter} : " in text, parameter


def test_a_run_gives_metrics_artifacts_and_logs(toy: ToyProject) -> None:
    toy.run_json()
    (run,) = kendama.runs(toy.home)
    again = kendama.open_run(run.name[:15], toy.home)
    assert (again.name, again.outcome, again.pipeline) == (run.name, "done", "toy")
    assert run.stages == ["roll", "total"]
    assert run.metrics("roll")["n"] == len(run.log("roll").table(run.log("roll").topics[0]))
    with pytest.raises(UsageError, match=r"has no stage 'rol', did you mean 'roll'. It has: roll, total"):
        run.metrics("rol")


def test_a_pipeline_is_run_and_read_without_the_command_line(tmp_path_factory: pytest.TempPathFactory) -> None:
    home = tmp_path_factory.mktemp("home")
    run = kendama.run("imitation", until="encode", home=home)
    assert run.outcome == "done"
    plan = run.artifact("encode")
    assert isinstance(plan, kendama.MotionPlan)
    assert kendama.play(plan, [0.0]).position_m.shape == (1, len(plan.coordinates))
    again = kendama.run("imitation", until="encode", home=home)
    assert [stage["status"] for stage in again.record["stages"]] == ["cached", "cached"]
    with pytest.raises(ConfigError, match="encode"):
        kendama.run("imitation", ["encode.functions=no"], home=home)


def test_a_ball_under_a_carried_cup_hangs_swings_and_says_where_it_came_down() -> None:
    t_s = np.arange(0.0, 1.0, 0.01)
    still = kendama.swing(t_s, np.zeros((100, 3)), after_s=0.2)
    game = kendama.configuration()["game"]
    hanging = game.rope.length_m + game.ball.mass_kg * game.gravity_m_s2 / game.rope.stiffness_n_m
    assert still.ball_m[:, 2] == pytest.approx(-hanging, abs=1e-6)
    assert (still.caught, still.miss_m, still.slack[1:].any()) == (False, None, False)
    assert kendama.swing(t_s, np.zeros((100, 3)), rope_m=0.3).ball_m[-1, 2] == pytest.approx(-0.3, abs=1e-3)
    lifted = np.column_stack([0 * t_s, 0 * t_s, np.where(t_s < 0.1, 0.0, np.minimum(0.3, 6 * (t_s - 0.1)))])
    thrown = kendama.swing(t_s, lifted, aside_m=0.001)
    assert thrown.slack.any(), "a cup that stops short leaves the ball flying"
    for wrong in (np.zeros((100, 2)), np.full((100, 3), np.nan)):
        with pytest.raises(ValueError, match=r"cup_m|finite"):
            kendama.swing(t_s, wrong)


def test_a_learned_policy_acts(tmp_path: Path) -> None:
    run = kendama.run("swingup", ["simulation/engine=rail", "learn/task=easy"], until="learn", home=tmp_path)
    policy = kendama.policy(run)
    policy.begin_rollout()
    acceleration_m_s2 = policy.act(kendama.SwingState(0.0, 0.0, 0.1, 0.5), 0.0)
    assert acceleration_m_s2 in kendama.configuration(["learn/task=easy"])["learn"].actions_m_s2
    with pytest.raises(UsageError, match="has no stage 'transfer'"):
        kendama.policy(run, "transfer")


def test_a_refused_recording_raises_its_message_and_is_no_run(tmp_path_factory: pytest.TempPathFactory) -> None:
    home = tmp_path_factory.mktemp("home")
    bad = tmp_path_factory.mktemp("recordings") / "bad.csv"
    bad.write_text("t_s,x_m,y_m,z_m\n0,0,0,0\n0,0,0,0\n0.2,0,0,0\n0.3,0,0,0\n")
    with pytest.raises(StageError, match="stage 'capture' of run"):
        kendama.run("imitation", [f"capture.path={bad}"], until="capture", home=home)
    assert kendama.runs(home) == []
