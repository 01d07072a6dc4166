"""Rope and drag from a free swing."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.errors import StageError
from kendama_cli.learning.state import SwingState
from kendama_cli.plugins.shared.kendama_fit import FreeSwing, measure_kendama, swing_in_its_plane
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings, MeasuredAir
from kendama_cli.simulation.swingup.rail import CompiledRail
from tests.shipped_conf import plain

GAME = build(GameSettings, plain("game", "kendama"), "game")
ROPE_M, K2 = 0.4031, 0.7 * GAME.drag[1]


def swung(angle_deg: float, duration_s: float, seed: int) -> FreeSwing:
    """The rail at rest with another rope and other air, at 60 Hz with 2 mm of noise, in a plane that is turned."""
    rope = dataclasses.replace(GAME.rope, length_m=ROPE_M)
    rail = CompiledRail(dataclasses.replace(GAME, rope=rope, air=MeasuredAir("measured", 0.0, K2)), 0.001)
    rail.start(SwingState(0.0, 0.0, math.radians(angle_deg), 0.0))
    times, positions = [], []
    for k in range(round(1000 * duration_s)):
        if k % 17 == 0:
            times.append(k / 1000)
            positions.append((0.6 * rail.across_m + 1.0, 0.8 * rail.across_m, rail.above_m + 1.2))
        rail.step(0.0)
    noise = np.random.default_rng(seed).normal(0.0, 0.002, (len(positions), 3))
    return swing_in_its_plane(np.array(times), np.array(positions) + noise)


def test_rope_and_drag_are_found_from_thirty_seconds_at_sixty_degrees() -> None:
    """To reach: drag at 3 m/s within 5 %, the rope within 0.5 mm."""
    kendama = measure_kendama(swung(64.0, 32.0, 10000), GAME).kendama
    drag, sigma = kendama.drag_n_s_m(3.0)
    assert drag == pytest.approx(3.0 * K2, rel=0.05)
    assert kendama.rope_m == pytest.approx(ROPE_M, abs=0.5e-3)
    assert 0.0 < sigma < 0.05 * drag
    applied = kendama.applied(GAME)
    assert applied.rope.length_m == kendama.rope_m
    assert applied.drag[1] == pytest.approx(max(kendama.quadratic_n_s2_m2, 0.0))


def test_a_swing_that_is_too_small_or_too_short_is_refused() -> None:
    with pytest.raises(StageError, match=r"too small .*: it starts at (29|30|31) deg; allowed: from 60"):
        measure_kendama(swung(30.0, 35.0, 0), GAME)
    with pytest.raises(StageError, match=r"too short to measure the drag: 20\.\d s; allowed: from 30 s"):
        measure_kendama(swung(70.0, 20.1, 0), GAME)
    with pytest.raises(StageError, match="has 3 samples; allowed: from 50"):
        measure_kendama(FreeSwing(np.arange(3.0), np.zeros((3, 2))), GAME)
