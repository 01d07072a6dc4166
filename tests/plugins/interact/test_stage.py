"""The stage that plays a script under force control: what it reaches on tables that it does not know."""

from __future__ import annotations

import dataclasses
import json
import os

import numpy as np
import pytest

from kendama_cli.errors import ConfigError, StageError
from kendama_cli.plugins.interact.stage import Interact
from kendama_cli.schema.settings import build
from kendama_cli.settings.hardware import CommandHardware, SimulatedHardware
from kendama_cli.settings.robot import Imperfection
from kendama_cli.stages.interface import StageResult
from tests import warm_command
from tests.memory_context import MemoryContext
from tests.plugins.interact.shipped_scene import body, press, robot, scene
from tests.shipped_conf import plain
from tests.simulation.dart.bench_robot import bench_arm

DIRECT = build(SimulatedHardware, plain("hardware", "simulated"), "hardware")


def _short(share=0.6, until="leave", **changed):
    """The shipped script as far as the step ``until``, with every step in ``share`` of its time."""
    settings = press(**changed)
    number = [step.name for step in settings.script].index(until) + 1
    steps = tuple(dataclasses.replace(step, duration_s=share * step.duration_s) for step in settings.script[:number])
    return dataclasses.replace(settings, script=steps)


def _play(*bodies, settings=None, hardware=DIRECT) -> tuple[StageResult, MemoryContext]:
    ctx = MemoryContext(seed=0)
    stage = Interact(interact=settings or _short(), scene=scene(*bodies), robot=bench_arm(), hardware=hardware)
    return stage.run({}, ctx), ctx


@pytest.mark.parametrize(
    ("table", "friction"),
    [
        pytest.param(body(), 0.4, marks=pytest.mark.slow),  # another arm plays it below
        pytest.param(body(friction=0.1, position_m=[0.0, 0.0, 0.977]), 0.1, marks=pytest.mark.slow),
        pytest.param(body(friction=0.8, position_m=[0.0, 0.0, 0.983]), 0.8, marks=pytest.mark.slow),
        pytest.param(body("soft_table", stiffness_n_m=1000.0), 0.4, marks=pytest.mark.slow),
        pytest.param(body("soft_table", stiffness_n_m=80000.0, friction=0.2), 0.2, marks=pytest.mark.slow),
    ],
)
def test_the_wanted_force_is_held_on_tables_of_any_stiffness_friction_and_height(table, friction):
    metrics = _play(table, settings=_short(until="wipe"))[0].metrics
    assert metrics["touched"] == "table"
    # a ball that begins to slide may leave the table for one step of the simulation
    assert metrics["contact_fraction"] > 0.99
    # 20 N wanted; measured on other tables than these (500 to 20000 N/m, friction 0 to 0.8): 0.23 to 0.41 N rms
    assert metrics["force_error_rms_n"] < 1.0
    assert metrics["friction"] == pytest.approx(friction, abs=0.02)
    assert metrics["effort_over_limit"] < 1.0


def test_another_arm_of_another_build_holds_the_force_as_well():
    stage = Interact(interact=_short(until="wipe"), scene=scene(body()), robot=robot("iiwa"), hardware=DIRECT)
    metrics = stage.run({}, MemoryContext(seed=0)).metrics
    assert metrics["touched"] == "table"
    assert metrics["force_error_rms_n"] < 1.0
    assert metrics["friction"] == pytest.approx(0.4, abs=0.02)
    assert metrics["speed_over_limit"] < 1.0


@pytest.mark.slow
def test_springs_alone_hold_the_force_only_as_well_as_the_table_stands_where_it_was_thought():
    errors = {
        kind: _play(body(position_m=[0.0, 0.0, 0.975]), settings=_short(kind=kind))[0].metrics["force_error_rms_n"]
        for kind in ("impedance", "force")
    }
    # 5 mm lower, so 4 mm below the reference: 800 N/m hold back 3.2 N
    assert errors["impedance"] > 2.0
    assert errors["force"] < 0.5 * errors["impedance"]


def test_where_nothing_is_met_the_tool_stays_near_its_reference_and_the_metrics_say_so():
    made, _ = _play(settings=_short(until="wipe"))
    metrics, result = made.metrics, made.artifact
    assert metrics["contact_fraction"] == 0.0
    assert metrics["friction"] is None
    assert metrics["touched"] is None
    assert metrics["force_error_rms_n"] == pytest.approx(20.0, abs=0.05)
    # the shipped reach_m, and 20 N on 800 N/m
    assert np.abs(result.tool_m - result.reference_m)[:, 2].max() < 0.05 + 20 / 800 + 0.005


def test_a_script_that_wants_no_force_has_no_force_error():
    settings = _short(until="approach")
    metrics = _play(body(), settings=settings)[0].metrics
    assert metrics["force_error_rms_n"] is metrics["force_error_max_n"] is metrics["contact_fraction"] is None
    assert metrics["peak_force_n"] < 0.5  # the probe's own inertia
    assert metrics["path_error_rms_mm"] < 1.0


def test_a_rerun_gives_the_same_result_bit_for_bit_and_logs_what_the_channels_promise():
    block = body() | {"kind": "free", "name": "block", "size_m": [0.03, 0.03, 0.03], "mass_kg": 0.2}
    block["position_m"] = [0.0, 0.1, 1.016]
    settings = _short(0.3, until="press")
    made, ctx = _play(body(), block, settings=settings)
    again, other = _play(body(), block, settings=settings)
    for field in dataclasses.fields(made.artifact):
        first, second = (getattr(one.artifact, field.name) for one in (made, again))
        assert np.array_equal(first, second), field.name
    assert made.metrics == again.metrics
    assert {topic for topic, _, _ in ctx.log.messages} == {
        f"/interact/{name}" for name in ("joints", "tool", "reference", "body", "wrench", "contact")
    }
    assert ctx.log.messages == other.log.messages
    result = made.artifact
    assert len(result.t_s) == round(0.3 * 2800)
    assert result.steps[0] == "approach"
    assert result.touched == ("table",)


def test_a_script_out_of_the_arms_reach_stops_in_the_step_that_leaves_it():
    settings = _short()
    far = dataclasses.replace(settings.script[1], position_m=(2.0, 0.0, 1.0))
    settings = dataclasses.replace(settings, script=(settings.script[0], far))
    message = (
        r"^step 'come down' at \d\.\d+ s: the tool of pa10 is 0\.10\d m from its reference \[.*\] m; allowed: "
        r"interact\.max_error_m, 0\.1; move interact\.script\[1\]\.position_m within reach, .*$"
    )
    with pytest.raises(StageError, match=message):
        _play(settings=settings)


def test_an_obstacle_in_the_way_stops_the_script_too():
    wall = body(position_m=[-0.06, 0.0, 1.2], size_m=[0.02, 0.4, 0.6])
    settings = _short(max_error_m=0.05)
    with pytest.raises(StageError, match=r"step 'approach' .* or move what stands in the way"):
        _play(wall, settings=settings)


@pytest.mark.parametrize("overrides", [[], ["scene=soft_table", "interact/controller=impedance"]])
def test_the_pipeline_press_is_declared_and_takes_other_scenes_and_controllers(overrides, tmp_path):
    document = json.loads(_kendama(tmp_path, "plan", "-p", "press", "--json", *overrides))
    assert [(stage["name"], stage["reasons"]) for stage in document["stages"]] == [("interact", ["never ran"])]


def test_a_robot_that_may_be_real_is_never_cached_and_moves_only_when_armed(tmp_path):
    document = json.loads(_kendama(tmp_path, "plan", "-p", "press", "hardware=command", "--json"))
    assert document["stages"][0]["reasons"] == ["moves hardware: every run is a new attempt"]
    refused = _finished(tmp_path, "run", "-p", "press", "hardware=command")
    assert refused.returncode == 2
    assert "stage 'interact' would move real hardware; clear its surroundings and add --arm" in refused.stderr
    assert len(refused.stderr.splitlines()) == 1


@pytest.mark.slow
def test_the_worked_example_runs_from_the_command_line_to_a_report_and_is_cached(tmp_path):
    document = json.loads(_kendama(tmp_path, "run", "-p", "press", "--json"))
    assert document["stages"][0]["metrics"]["touched"] == "table"
    assert json.loads(_kendama(tmp_path, "plan", "-p", "press", "--json"))["stages"][0]["reasons"] == []
    _kendama(tmp_path, "report", "-o", "press.html")
    assert "Desired and exerted force" in (tmp_path / "press.html").read_text()


def _finished(folder, *arguments):
    return warm_command.kendama(arguments, folder, os.environ, 240)


def _kendama(folder, *arguments):
    done = _finished(folder, *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_with_friction_that_nobody_models_the_force_is_held_all_the_same():
    """Measured with the shipped twin's, the whole script: 0.52 N rms of 20 N wanted, where an exact arm has 0.29."""
    worn = dataclasses.replace(
        DIRECT, imperfection=build(Imperfection, plain("hardware", "twin")["imperfection"], "imperfection")
    )
    metrics = _play(body(), settings=_short(until="hold"), hardware=worn)[0].metrics
    assert metrics["touched"] == "table"
    assert metrics["force_error_rms_n"] < 1.5


def test_another_robot_than_a_simulated_one_is_refused_in_one_line_before_anything_moves():
    with pytest.raises(ConfigError, match=r"^'hardware.kind' is 'command'; .*: choose hardware=simulated; nothing was"):
        _play(body(), hardware=CommandHardware("command", "127.0.0.1", 1, "no key", 5.0))
