"""``kendama robot place`` as a user runs it, in a fresh folder: a table, a node that works, one line for an error."""

from __future__ import annotations

import json
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests import warm_command

BRIEF = ["--effort", "0.03"]
ONE = "capture.path=data/demonstrations/swing-04.csv"


def kendama(folder: Path, *arguments: str, expect: int = 0) -> subprocess.CompletedProcess[str]:
    done = warm_command.kendama(arguments, folder, os.environ, 240, libraries=True)
    assert done.returncode == expect, done.stderr
    return done


def swing(folder: Path, size_m: float, duration_s: float) -> str:
    """A demonstration to the side and up and back, as a file."""
    t_s = np.arange(0.0, duration_s, 0.005)
    share = np.sin(np.pi * t_s / duration_s) ** 3
    rows = np.column_stack([t_s, size_m * share, 0 * t_s, 0.1 * size_m * share])
    text = "t_s,x_m,y_m,z_m\n" + "\n".join(",".join(f"{value:.6f}" for value in row) for row in rows)
    (folder / "swing.csv").write_text(text + "\n")
    return "capture.path=swing.csv"


@pytest.mark.slow
def test_the_node_that_is_written_is_the_placement_that_is_shown(tmp_path: Path) -> None:
    done = kendama(tmp_path, "robot", "place", ONE, *BRIEF, "--json", "-o", "conf/robot/mine.yaml")
    shown = json.loads(done.stdout)
    assert [row["joint"] for row in shown["joints"]] == ["s1", "s2", "s3", "e1", "e2", "w1", "w2"]
    assert shown["leading"][0]["ratio"] == max(
        row[kind] for row in shown["joints"] for kind in ("speed", "acceleration", "effort")
    )
    assert shown["leading"][0]["ratio"] < 1.0
    assert shown["clearance"]["gap_m"] > 0.0
    node = yaml.safe_load(kendama(tmp_path, "config", "robot=mine").stdout)["robot"]
    assert node["home_rad"] == shown["placement"]["home_rad"]
    assert node["tool"]["cup_axis"] == shown["placement"]["cup_axis"]
    assert node["redundancy_weights"] == shown["placement"]["redundancy_weights"]
    assert node["name"] == "mine"


@pytest.mark.slow
def test_a_pipeline_that_learns_a_swing_up_is_placed_with_its_line(tmp_path: Path) -> None:
    imitated, performed, played, lined = (
        json.loads(kendama(tmp_path, "robot", "place", *words, ONE, *BRIEF, "--json").stdout)["placement"]
        for words in ([], ["-p", "perform"], ["-p", "kendama"], ["--line"])
    )
    assert imitated == performed
    assert played == lined != imitated


def test_the_table_names_every_joint_and_marks_who_leads(tmp_path: Path) -> None:
    done = kendama(tmp_path, "robot", "place", ONE, *BRIEF)
    head, *rows = done.stdout.splitlines()
    assert head.split() == ["joint", "position", "speed", "acceleration", "effort", "to", "stop"]
    assert [row.split()[0] for row in rows[:7]] == ["s1", "s2", "s3", "e1", "e2", "w1", "w2"]
    assert sum(row.count("<") for row in rows[:7]) == 3
    assert "clearance" in rows[8]
    assert "mm between" in rows[8]
    assert not (tmp_path / "conf").exists()


@pytest.mark.parametrize(
    ("size_m", "duration_s", "message"),
    [
        # tests/stages/test_placed.py has this message from the stage
        pytest.param(5.0, 4.0, r"leaves the workspace of pa10: at ", marks=pytest.mark.slow),
        (0.5, 0.35, r"the best placement found needs .* pa10 can play the game at no size down to 0.2: "),
    ],
)
def test_what_no_placement_can_do_is_told_in_one_line_and_nothing_is_written(
    tmp_path: Path, size_m: float, duration_s: float, message: str
) -> None:
    wide = ["capture.plausible.max_extent_m=9", "capture.plausible.max_speed_m_s=20"]
    file = swing(tmp_path, size_m, duration_s)
    done = kendama(tmp_path, "robot", "place", file, *wide, *BRIEF, "-o", "mine.yaml", expect=1)
    said = [line for line in done.stderr.splitlines() if line.startswith("kendama: ")]
    assert len(said) == 1
    assert re.search(message, said[0]), said[0]
    assert not (tmp_path / "mine.yaml").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("setting", "tau"), [("adapt.swing_scale=0.2", 1.0), ("adapt.tau_range=[0.8,6]", None), ("adapt.tau_start=4", 4.0)]
)
def test_what_the_refusal_advises_makes_the_same_motion_workable(
    tmp_path: Path, setting: str, tau: float | None
) -> None:
    wide = ["capture.plausible.max_extent_m=9", "capture.plausible.max_speed_m_s=20"]
    ranged = ["adapt.tau_range=[0.8,6]"] if setting.startswith("adapt.tau_start") else []
    done = kendama(tmp_path, "robot", "place", swing(tmp_path, 0.5, 0.35), *wide, *BRIEF, setting, *ranged, "--json")
    shown = json.loads(done.stdout)
    assert shown["leading"][0]["ratio"] <= 1.0
    assert tau is None or shown["tau_scale"] == tau
    assert shown["tau_scale"] >= min(shown["min_tau_scale"], 6.0)


def test_a_node_must_be_a_yaml_file(tmp_path: Path) -> None:
    done = kendama(tmp_path, "robot", "place", "-o", "mine.txt", expect=2)
    assert "-o mine.txt: a node is a YAML file; name it like conf/robot/mine.yaml" in done.stderr
    assert not (tmp_path / ".kendama").exists()


@pytest.mark.parametrize(("command", "artifact"), [("place", "MotionPlan"), ("check", "CatchMotion")])
def test_a_pipeline_that_declares_no_such_result_is_refused_before_anything_runs(
    tmp_path: Path, command: str, artifact: str
) -> None:
    done = kendama(tmp_path, "robot", command, "-p", "swingup", expect=2)
    assert f"pipeline 'swingup' has no stage that returns a {artifact} (learn a PolicyArtifact, " in done.stderr
    assert "name another with -p" in done.stderr
    assert not (tmp_path / ".kendama" / "runs").exists()
