"""Another physics on the same way of the cup."""

from __future__ import annotations

import dataclasses
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kendama_cli.errors import InputError
from kendama_cli.physics.rope import RopeLaw, rope_pull
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings, LinearAir
from kendama_cli.simulation.referee.chain import Body, damping_ratio
from kendama_cli.simulation.referee.cup_track import CupTrack
from kendama_cli.simulation.referee.replay import Replay, replay
from tests.shipped_conf import plain

pytest.importorskip("mujoco", reason="mujoco (the extra 'referee') is not installed")
GAME = build(GameSettings, plain("game", "kendama"), "game")
STILL = dataclasses.replace(GAME, air=LinearAir("linear", 0.0))


def seen(game: GameSettings, cup_x: Any, ball_m: list[float], until_s: float) -> Replay:
    """An upright cup that moves along x as ``cup_x`` says."""
    t_s = np.arange(0.0, until_s, 0.01)
    cup = np.column_stack([cup_x(t_s), np.zeros_like(t_s), np.zeros_like(t_s)])
    track = CupTrack(t_s, cup, np.tile([0.0, 0.0, 1.0], (len(t_s), 1)))
    body = Body(game.rope.length_m, game.ball.mass_kg, game.drag, game.cup.restitution)
    return replay(game, body, track, np.array(ball_m))


def ours(game: GameSettings, cup_x: Any, ball_m: list[float], t_s: np.ndarray) -> np.ndarray:
    """The plain law by semi-implicit Euler at 0.1 ms, at the times ``t_s``."""
    law, (k1, k2), h, mass = RopeLaw.of(game), game.drag, 1e-4, game.ball.mass_kg
    place, speed, out = np.array(ball_m), np.zeros(3), []
    for k in range(round(t_s[-1] / h) + 1):
        if len(out) < len(t_s) and k * h >= t_s[len(out)] - 1e-9:
            out.append(place.copy())
        cup = float(cup_x(k * h))
        rate = float(cup_x(k * h + h) - cup_x(k * h - h)) / (2 * h)
        pull = rope_pull(law, (place[0] - cup, 0.0, place[2]), (speed[0] - rate, 0.0, speed[2]))
        force = np.array(pull.force_n if pull else (0.0, 0.0, 0.0)) - (k1 + k2 * np.linalg.norm(speed)) * speed
        speed = speed + h * (force / mass - [0.0, 0.0, game.gravity_m_s2])
        place = place + h * speed
    return np.array(out)


def test_a_swing_of_an_accelerated_cup_is_the_same_on_the_chain() -> None:
    """Below the cup, where rope and chain differ by weight (1 %) and thickness only: 2 mm after two swings."""
    cup_x = lambda t: 0.15 * (1 - np.cos(4.0 * np.asarray(t)))  # noqa: E731
    start = [0.0, 0.0, -(0.4 + 0.05 * 9.81 / 2000)]
    theirs = seen(GAME, cup_x, start, 1.4)
    apart = np.linalg.norm(ours(GAME, cup_x, start, theirs.t_s) - theirs.ball_m, axis=1)
    assert np.ptp(theirs.ball_m[:, 0]) > 0.4
    assert apart.max() < 3e-3


def test_a_ball_over_the_mouth_hangs_on_a_rope_that_goes_round_the_cup() -> None:
    """Let go high beside the cup, the ball swings about its edge: where ours is, and not where a straight rope is."""
    angle = math.radians(85.0)
    start = [0.4 * math.sin(angle), 0.0, -0.4 * math.cos(angle)]
    push = lambda t: -0.5 * 14.0 * np.minimum(np.asarray(t), 0.15) ** 2 - 2.1 * np.maximum(np.asarray(t) - 0.15, 0.0)  # noqa: E731
    theirs = seen(STILL, push, start, 0.6)
    apart = np.linalg.norm(ours(STILL, push, start, theirs.t_s) - theirs.ball_m, axis=1)
    assert apart.max() < 0.02


@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.9])
def test_the_contacts_damping_gives_back_the_restitution(restitution: float) -> None:
    """A linear spring and damper give back exp(-pi z / sqrt(1 - z^2)) of the speed."""
    ratio = damping_ratio(restitution)
    assert math.exp(-math.pi * ratio / math.sqrt(1 - ratio**2)) == pytest.approx(restitution)


def test_a_way_of_a_few_samples_is_refused() -> None:
    with pytest.raises(InputError, match="has 3 samples; at least 8"):
        CupTrack(np.arange(3.0), np.zeros((3, 3)), np.tile([0.0, 0.0, 1.0], (3, 1)))


def test_on_the_shipped_demonstrations_the_referee_catches_too(tmp_path: Path) -> None:
    """Through the command: a run's logged repeats, their document, and the section of the report."""

    def kendama(*words: str) -> str:
        command = [sys.executable, "-m", "kendama_cli.cli.main", "--home", str(tmp_path), *words]
        return subprocess.run(command, check=True, capture_output=True, text=True, cwd=tmp_path).stdout

    kendama("run", "-p", "imitation", "adapt.repeats=2", "adapt.tau_range=[1.1,1.2]", "adapt.tau_start=1.143")
    document = json.loads(kendama("referee", "--json"))
    assert set(document) == {"games", "caught_rate", "agreement_mm_p50"}
    assert [game["stage"] for game in document["games"]] == ["adapt", "adapt"]
    wanted = {"stage", "index", "ours_miss_mm", "referee_miss_mm", "ours_caught", "referee_caught"}
    assert all(set(game) == wanted for game in document["games"])
    assert document["caught_rate"] == 1.0
    assert document["agreement_mm_p50"] < 14.0  # 0.1 to 13.6 mm were seen over eight repeats
    page = Path(kendama("report").strip())
    assert "Under another physics" in (tmp_path / page).read_text()
