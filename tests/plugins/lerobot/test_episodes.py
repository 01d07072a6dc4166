"""kendama log export --format lerobot: demonstrations and games as LeRobot reads them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from kendama_cli.config.compose import composed
from kendama_cli.config.site import find_site
from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.log.reader import LogFile
from kendama_cli.pipeline.nodes import build_settings
from tests.cli.typed import kendama, refused

FPS = 50
WRITTEN_BY_LEROBOT = ("timestamp", "frame_index", "episode_index", "index", "task_index")
"""The columns that LeRobot 0.4.4 adds to a dataset of its own."""


@pytest.fixture
def datasets(tmp_path: Path, logs: dict[str, Path], capsys: pytest.CaptureFixture[str]) -> dict[str, Path]:
    for name in ("capture", "transfer"):
        words = ("log", "export", str(logs[name]), "--format", "lerobot", "--fps", str(FPS))
        assert kendama(capsys, *words, "-o", str(tmp_path / name))[0] == 0
    return {name: tmp_path / name for name in ("capture", "transfer")}


def frames(folder: Path) -> pd.DataFrame:
    return pd.read_parquet(folder / "data/chunk-000/file-000.parquet")


def stacked(table: pd.DataFrame, key: str) -> np.ndarray:
    return np.stack(list(table[key]))


def test_rows_and_episodes_are_counted_as_lerobot_counts_them(datasets: dict[str, Path]) -> None:
    for folder in datasets.values():
        info = json.loads((folder / "meta/info.json").read_text())
        table = frames(folder)
        assert (info["codebase_version"], info["fps"], info["total_frames"]) == ("v3.0", FPS, len(table))
        assert set(table) == set(info["features"]) >= set(WRITTEN_BY_LEROBOT)
        np.testing.assert_array_equal(table["index"], np.arange(len(table)))
        # LeRobot refuses stamps that are further than 0.1 ms from frame / fps
        np.testing.assert_allclose(table["timestamp"], table["frame_index"] / FPS, atol=1e-5)
        episodes = pd.read_parquet(folder / "meta/episodes/chunk-000/file-000.parquet")
        assert list(episodes["length"]) == list(table.groupby("episode_index").size())
        assert list(episodes["dataset_to_index"]) == list(np.cumsum(episodes["length"]))
        assert list(table["index"][table["next.done"]]) == [end - 1 for end in episodes["dataset_to_index"]]
        assert list(pd.read_parquet(folder / "meta/tasks.parquet").index) == [episodes["tasks"][0][0]]
        stats = json.loads((folder / "meta/stats.json").read_text())
        np.testing.assert_allclose(stats["action"]["mean"], stacked(table, "action").mean(axis=0), atol=1e-6)
        assert set(stats) == set(info["features"])


def test_a_demonstration_is_the_logged_hand_and_its_action_the_next_frame(
    datasets: dict[str, Path], logs: dict[str, Path]
) -> None:
    table = frames(datasets["capture"])
    cups = LogFile(logs["capture"]).table("/capture/cup")
    third = cups[cups["child"] == "swing-02"]
    mine = table[table["episode_index"] == 2]
    state, action = stacked(mine, "observation.state"), stacked(mine, "action")
    logged = third[["x_m", "y_m", "z_m"]].to_numpy()[::2]  # every second of 100 Hz
    np.testing.assert_allclose(state[: len(logged), :3], logged[: len(state)], atol=1e-6)
    np.testing.assert_array_equal(action[:-1], state[1:])
    assert "next.success" not in table, "nobody judged it"


def test_a_game_is_what_was_measured_its_action_what_was_sent_and_its_success_the_catch(
    datasets: dict[str, Path], logs: dict[str, Path]
) -> None:
    table, log = frames(datasets["transfer"]), LogFile(logs["transfer"])
    games = log.table("/transfer/game")
    assert table["episode_index"].nunique() == len(games) > 1
    ends = table[table["next.done"]]
    assert list(ends["next.success"]) == list(games["caught"])
    assert not table["next.success"][~table["next.done"]].any()
    sent = log.table("/transfer/exchange")
    start_s = float(log.table("/transfer/step").query("rollout == -1")["t_s"].min())
    mine = table[table["episode_index"] == 0].iloc[:20]
    at_s = start_s + mine["frame_index"].to_numpy() / FPS
    for key, column, late_s in (("observation.state", "measured_rad", 0.0), ("action", "sent_rad", 1 / FPS)):
        wanted = np.interp(at_s + late_s, sent["t_s"], stacked(sent, column)[:, 0])
        np.testing.assert_allclose(stacked(mine, key)[:, 0], wanted, atol=1e-6)
    assert stacked(table, "observation.environment_state").shape[1] == 6


def test_what_cannot_be_exported_is_one_line(
    tmp_path: Path, logs: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    lerobot = ("--format", "lerobot", "-o", str(tmp_path / "out"))
    line = refused(capsys, "log", "export", str(logs["learn"]), *lerobot)
    assert line.endswith("holds no episodes to learn from; the logs of capture, transfer do")
    assert "takes no --topic" in refused(capsys, "log", "export", str(logs["capture"]), "--topic", "/a", *lerobot)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine").write_text("kept")
    assert "not empty" in refused(capsys, "log", "export", str(logs["capture"]), *lerobot)


def test_swings_without_orientation_have_no_columns_of_it(datasets: dict[str, Path]) -> None:
    features = json.loads((datasets["capture"] / "meta/info.json").read_text())["features"]
    for key in ("observation.state", "action"):
        assert (features[key]["names"], features[key]["shape"]) == (["cup.x_m", "cup.y_m", "cup.z_m"], [3])
        assert stacked(frames(datasets["capture"]), key).std(axis=0).min() > 0, "a constant column"


@pytest.mark.slow
def test_the_validators_of_lerobot_lint_find_only_that_a_swing_hardly_goes_sideways(datasets: dict[str, Path]) -> None:
    """Of y, joint 1, they say that it never moved: a swing lies in a plane. (pip install lerobot-lint)"""
    linter = shutil.which("lelint")
    if linter is None:
        pytest.skip("needs lelint (pip install lerobot-lint)")
    told = subprocess.run(
        [linter, "check", str(datasets["capture"])], capture_output=True, text=True, check=False, timeout=600
    ).stdout
    assert "Summary:" in told
    errors = [line for line in told.splitlines() if re.match(r"\s*\[[A-Z_]+\] episode", line)]
    assert all("[DEAD_JOINT]" in line and "Joint 1 never moved" in line for line in errors)


@pytest.mark.slow
def test_lerobots_own_loader_reads_them(datasets: dict[str, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    module = pytest.importorskip("lerobot.datasets.lerobot_dataset", reason="needs lerobot (pip install lerobot)")
    for name, folder in datasets.items():
        ahead = {"action": [k / FPS for k in range(8)]}
        read = module.LeRobotDataset(f"kendama/{name}", root=folder, delta_timestamps=ahead)
        table = frames(folder)
        assert len(read) == len(table)
        np.testing.assert_array_equal(read[3]["observation.state"].numpy(), table["observation.state"][3])
        np.testing.assert_array_equal(read[3]["action"].numpy()[1], table["action"][4])
        end = int(read.meta.episodes[0]["dataset_to_index"]) - 1
        assert read[end]["action_is_pad"].tolist() == [False] + [True] * 7


def test_a_dataset_of_ours_is_read_as_demonstrations_without_a_layout(
    datasets: dict[str, Path], tmp_path: Path
) -> None:
    """The folder and its file alike; a demonstration an episode, at the rate of the export."""
    folder = datasets["capture"]
    expected = [stacked(one, "observation.state")[:, :3] for _, one in frames(folder).groupby("episode_index")]
    for path in (folder, folder / "data/chunk-000/file-000.parquet"):
        config = composed(find_site(tmp_path / "home"), ["capture=file", f"capture.path='{path}'"])
        hands = open_demonstrators(build_settings(config)["capture"])
        found = [np.array([sample.position_m for sample in hand.samples()]) for hand in hands]
        assert len(found) == len(expected)
        for one, true in zip(found, expected, strict=True):
            np.testing.assert_allclose(one, true, atol=1e-6)
        assert [round(hand.rate_hz) for hand in hands] == [FPS] * len(expected)
