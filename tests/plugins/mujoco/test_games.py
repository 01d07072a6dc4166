"""Whole games on an arm in MuJoCo, as a user runs them: learned in our simulation, seen by virtual cameras."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="mujoco (the extra 'mujoco') is not installed")

from tests.plugins.mujoco.arms import own_iiwa
from tests.test_whole_game import run
from tests.toy_project import statuses

FEW = ("simulation/engine=rail", "transfer.evaluation_rollouts=1", "transfer.max_rollouts=1", "transfer.games=2")


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_games_are_caught_where_the_servos_follow_and_the_arm_is_read_anew_where_it_changed(tmp_path: Path) -> None:
    model = own_iiwa(tmp_path, kp=20000.0, lag_s=0.01)
    words = ("-p", "swingup", "robot=iiwa", "hardware=mujoco", f"hardware.model={model}", *FEW)
    made = run(tmp_path, *words)
    metrics = {stage["name"]: stage["metrics"] for stage in made["stages"]}["transfer"]
    assert (metrics["success_rate_after"], metrics["caught_rate"], metrics["missed_packets"]) == (1, 1, 0)
    assert statuses(run(tmp_path, *words)) == {"learn": "cached", "transfer": "cached"}
    own_iiwa(tmp_path, kp=19000.0, lag_s=0.01)
    assert statuses(run(tmp_path, *words)) == {"learn": "cached", "transfer": "ran"}
