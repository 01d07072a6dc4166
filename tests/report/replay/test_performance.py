"""Replay of a log: the logged positions, evenly sampled, and nothing besides."""

from __future__ import annotations

import base64
import json
import re

import numpy as np
import pytest

from kendama_cli.report.replay.page_part import replay
from kendama_cli.report.replay.performance import Frames, Performance, came_down_s, performance
from kendama_cli.report.source import StageLog
from tests.report.replay.undrawn import undrawn_report
from tests.report.synthetic_swing import played_swing

STILL = np.array([1.0, 0.0, 0.0, 0.0])


def _scene(page: str) -> list[dict]:
    found = re.search(r'class="replay".*?application/json">(.*?)</script>', page, re.DOTALL)
    return json.loads(found[1])["performances"]


def _poses(frames: dict) -> np.ndarray:
    whole = np.frombuffer(base64.b64decode(frames["poses"]), "<i2").reshape(-1, len(frames["names"]), 7)
    return np.concatenate([whole[..., :3] * frames["step"], whole[..., 3:] / 32767], axis=-1)


def test_cup_and_ball_are_where_the_log_has_them(logs) -> None:
    """Written every 4 ms along curves of at most 40 m/s^2, shown every 10 ms: a straight line is off by 0.5 mm."""
    found = performance(StageLog(logs["adapt"]), "/adapt", "swing", "simulation", scene="/adapt/scene")
    t = found.bodies.start_s + np.arange(len(found.bodies.poses)) / found.bodies.rate_hz
    cup, ball = played_swing(t)
    away = np.abs(t[:, None] - [1.5, 1.9]).min(axis=1) > 0.02  # the made-up ball jumps there
    for name, path in (("cup", cup), ("ball", ball)):
        shown = found.bodies.poses[:, found.bodies.names.index(name), [0, 2]] - [0.5, 1.0]
        assert np.abs(shown - path)[away].max() < 1e-3


def test_the_links_keep_their_names_and_the_arm_its_reach(logs) -> None:
    found = performance(StageLog(logs["adapt"]), "/adapt", "swing", "simulation", scene="/adapt/scene")
    assert found.links.names == ("post", "link")
    assert {solid.frame for solid in found.solids} == {"post", "link", "cup", "ball"}
    np.testing.assert_allclose(found.links.poses[:, 1, :3], [[0.5, -0.5, 1.1]] * len(found.links.poses), atol=1e-12)
    w, x, y, z = found.links.poses[:, 1, 3:].T
    way = np.column_stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x**2 + y**2)])
    cup = found.bodies.poses[:, found.bodies.names.index("cup"), :3]
    at = np.arange(len(way)) * found.bodies.rate_hz / found.links.rate_hz
    toward = cup[at.astype(int).clip(max=len(cup) - 1)] - [0.5, -0.5, 1.1]
    cosine = (way * toward).sum(axis=1) / np.linalg.norm(toward, axis=1)
    assert cosine.min() > np.cos(0.03)  # the cup's 0.8 m/s over one sample, at 0.5 m


def test_the_catch_is_when_the_ball_comes_down_through_the_rim() -> None:
    t = np.arange(0, 2.0, 0.01)
    height = 0.3 - 0.5 * 9.81 * (t - 0.2) ** 2
    ball = np.column_stack([0 * t, 0 * t, height])
    poses = np.stack([np.tile([0, 0, 0, *STILL], (len(t), 1)), np.hstack([ball, np.tile(STILL, (len(t), 1))])], axis=1)
    assert came_down_s(Frames(("cup", "ball"), 5.0, 100.0, poses), 0.07) == pytest.approx(
        5.2 + np.sqrt(2 * (0.3 - 0.07) / 9.81), abs=0.011
    )
    poses[:, 1, 0] += 0.2
    assert came_down_s(Frames(("cup", "ball"), 5.0, 100.0, poses), 0.07) is None


@pytest.mark.parametrize("far_m", [1.0, 8.0])
def test_what_is_packed_is_what_was_logged(far_m: float) -> None:
    rng = np.random.default_rng(7)
    turns = rng.normal(size=(20, 2, 4))
    turns /= np.linalg.norm(turns, axis=-1, keepdims=True)
    poses = np.concatenate([far_m * rng.uniform(-1, 1, (20, 2, 3)), turns], axis=-1)
    shown = Performance("one", "simulation", Frames(("cup", "ball"), 0.0, 100.0, poses))
    (packed,) = _scene(replay([shown]))
    read = _poses(packed["bodies"])
    assert np.abs(read[..., :3] - poses[..., :3]).max() <= max(1e-4, far_m / 32767) / 2 * 1.001
    assert np.abs(read[..., 3:] - poses[..., 3:]).max() <= 0.5 / 32767 * 1.001


def test_a_demonstration_begins_where_the_arms_cup_does() -> None:
    def along_x(start_m: tuple[float, float, float], *names: str) -> Frames:
        places = np.array(start_m) + np.linspace(0, 1, 5)[:, None, None] * np.array([0.1, 0.0, 0.0])
        poses = np.concatenate([np.tile(places, (1, len(names), 1)), np.tile(STILL, (5, len(names), 1))], axis=-1)
        return Frames(names, 0.0, 100.0, poses)

    shown = Performance("robot", "simulation", along_x((0.5, 0.1, 1.2), "cup", "ball"))
    person = Performance("person", "demonstration", along_x((9.0, 9.0, 9.0), "cup"), placed=False)
    packed = {one["label"]: _poses(one["bodies"]) for one in _scene(replay([person, shown]))}
    np.testing.assert_allclose(packed["person"][:, 0, :3], packed["robot"][:, 0, :3], atol=1e-3)


def test_a_run_shows_every_motion_that_its_logs_hold(run, logs) -> None:
    shown = _scene(undrawn_report(run, logs, "capture", "adapt", "learn", "transfer"))
    assert [one["label"] for one in shown] == [
        "Adapted swing, simulated",
        "Imitated swing, twin",
        "Full game, twin",
        "Demonstration swing-00",
        "Learned swing-up, simulated",
    ]
    game = shown[2]
    assert len(game["ahead"]) == 12
    assert game["catch"] == pytest.approx(game["ahead"][0][1], abs=0.1)


def test_labels_and_names_of_a_log_cannot_leave_their_place() -> None:
    poses = np.tile([0, 0, 1, *STILL], (5, 2, 1)).astype(float)
    evil = Performance("</script><b>", "simulation", Frames(("cup", "ball"), 0.0, 100.0, poses))
    page = replay([evil, evil])
    assert "<b>" not in page
    assert page.count("</script>") == 1
    assert _scene(page)[0]["label"] == "</script><b>"
