"""Reading of a URDF as ``kendama robot describe`` tells it, before a run's first stage, and in its closing lines."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from kendama_cli.cli import render
from kendama_cli.cli.main import main
from kendama_cli.config.compose import composed
from kendama_cli.config.site import find_site
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.pipeline.plan import Planner
from kendama_cli.pipeline.record import begin
from kendama_cli.store.home import run_names
from kendama_cli.store.store import Store
from tests.cli.typed import kendama, refused
from tests.robot_model.test_real_urdfs import LIMIT, arm


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An arm of five joints in a folder of its own, whose tip is not where its joints are."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("KENDAMA_HOME", str(tmp_path / "home"))
    path = tmp_path / "arm.urdf"
    path.write_text(arm().replace('rpy="0.3 0.2 0.1"', 'rpy="0 0 0"'))
    return path


@pytest.mark.usefixtures("file")
def test_a_page_tells_joints_tip_limits_and_where_each_is_from(capsys: pytest.CaptureFixture[str]) -> None:
    robot = (
        "robot=urdf",
        "robot.path=arm.urdf",
        "robot.effort_nm=[9,8,7,6,5]",
        "robot.rotor_inertia_kg_m2=[1,1,1,1,1]",
    )
    code, out, _ = kendama(capsys, "robot", "describe", *robot)
    assert code == 0
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines()}
    assert rows["j2"] == ["revolute", "-2", "2", "3", "20", "8", "1", "0", "0"]
    assert "  effort: robot.effort_nm" in out
    assert "  speed: the file's <limit velocity>" in out
    assert "tip: 'tool0', with all joints at 0 at (0.6000, 0.0000, 1.2000) m from 'base'" in out  # six times 0.1, 0.2
    code, out, _ = kendama(capsys, "robot", "describe", *robot, "--json")
    page = json.loads(out)
    assert (page["joints"], page["tip_link"], page["refused"]) == (["j1", "j2", "j3", "j4", "j5"], "tool0", None)
    assert page["tip_at_zero_m"] == pytest.approx([0.6, 0.0, 1.2], abs=1e-12)


def test_what_is_missing_is_told_on_the_page_and_before_the_first_stage(
    capsys: pytest.CaptureFixture[str], file: Path
) -> None:
    file.write_text(arm().replace(LIMIT, LIMIT.replace("80", "0")))
    robot = ("robot=urdf", "robot.path=arm.urdf")
    code, out, _ = kendama(capsys, "robot", "describe", *robot, "--json")
    page = json.loads(out)
    assert code == 2
    assert len(page["joints"]) == 5
    words = "no effort limit (0 stands for not known) for 5 joints: j1, j2, j3, j4, j5; give it beside the file: robot."
    for told in (
        page["refused"],
        refused(capsys, "plan", "-p", "imitation", *robot),
        refused(capsys, "run", "-p", "imitation", *robot),
    ):
        assert words in told
    assert run_names(Path("home")) == []
    assert main(["plan", "-p", "imitation", *robot, "robot.effort_nm=[9,9,9,9,9]"]) == 0


@pytest.mark.usefixtures("file")
def test_joints_and_tip_stand_in_the_closing_lines(capsys: pytest.CaptureFixture[str]) -> None:
    site = find_site(None, None)
    settings = build_settings(composed(site, ["robot=urdf", "robot.path=arm.urdf"]))
    planner = Planner(Store(site.home), load_pipeline("imitation", site.pipeline_folders), settings, site.data_roots)
    record = begin(site.home, "imitation", [])
    record.read = planner.read_lines
    render.summary(record, "")
    out, _ = capsys.readouterr()
    assert "read             arm: 5 joints from 'base' to 'tool0': j1, j2, j3, j4, j5" in out
    assert record.document()["read"] == list(planner.read_lines)


def test_an_arm_of_ones_own_is_called_by_its_file_and_the_next_command_is_told(
    recordings: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The gen3's odd joints turn without end."""
    path = recordings / "urdf" / "kinova_gen3.urdf"
    code, out, _ = kendama(capsys, "robot", "describe", "robot=urdf", f"robot.path={path}")
    assert code == 0
    assert out.startswith(f"kinova_gen3: {path.resolve()}\n")
    placed = f"kendama robot place robot=urdf robot.path={path} -o conf/robot/kinova_gen3.yaml"
    assert out.endswith(f"can be simulated\nnext: {placed}\n")


def test_an_arm_that_stands_somewhere_is_told_what_the_swing_takes_of_each_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("KENDAMA_HOME", str(tmp_path))
    code, out, _ = kendama(capsys, "robot", "describe", "robot=iiwa")
    assert code == 0
    table = out[out.index("the swing at this placement") :].splitlines()
    assert table[1].split() == ["joint", "position", "speed", "acceleration", "effort", "to", "stop"]
    rows = {line.split()[0]: [float(word) for word in line.replace("<", "").split()[1:5]] for line in table[2:9]}
    assert set(rows) == {f"a{k}" for k in range(1, 8)}
    assert max(max(shares) for shares in rows.values()) <= 1.0
    assert any(line.startswith("tempo: fits from tau_scale 0.") for line in table)
    assert table[-1] == "next: kendama run -p imitation robot=iiwa"
    slow = "robot.velocity_rad_s=[0.5,0.5,0.5,0.5,0.5,0.5,0.5]"
    code, out, _ = kendama(capsys, "robot", "describe", "robot=iiwa", slow, "--json")
    swing = json.loads(out)["swing"]
    assert not swing["fits"]
    assert swing["leading"][0]["ratio"] > 1.0
    assert swing["min_tau_scale"] > 1.25  # beyond adapt.tau_range
