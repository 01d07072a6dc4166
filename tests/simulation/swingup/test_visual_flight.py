"""The catch of an evaluation by late, noisy measurements of the ball."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest

from kendama_cli.learning.state import SwingState
from kendama_cli.physics.taut_rope import Ball, TautRope
from kendama_cli.simulation.swingup import visual_flight
from kendama_cli.simulation.swingup.environment import fly
from kendama_cli.simulation.swingup.rail import CompiledRail
from kendama_cli.simulation.swingup.visual_flight import FlightEstimate, caught_by_sight
from tests.learning.settings_files import game_settings, learn_settings

GAME = game_settings()
EXACT = {
    "noise__angle_reading_deg": 0.0,
    "noise__rate_reading_rad_s": 0.0,
    "sensor__sigma_m": 1e-7,
    "sensor__latency_s": 0.0,
    "sensor__rate_hz": 500.0,
}


def releases(n: int) -> list[SwingState]:
    rng = np.random.default_rng(10000)
    low, high = (-0.1, -0.5, 1.9, 2.0), (0.1, 0.5, 2.6, 7.0)
    return [SwingState(*rng.uniform(low, high).tolist()) for _ in range(n)]


def test_by_exact_sight_the_cup_catches_what_it_catches_where_it_knows_the_ball() -> None:
    """A ball at the edge of the mouth may fall either way, as the estimate leaves the air out: 1 of 100 here."""
    settings = learn_settings("hard", **EXACT)
    seen, known = [], []
    for state in releases(300):
        seen.append(caught_by_sight(state, settings, GAME, np.random.default_rng(0)))
        swing = CompiledRail(GAME, settings.step_s)
        swing.start(state)
        known.append(fly(swing, settings, GAME, 0.0, None).caught)
    assert 30 < sum(known) < 270
    assert np.mean(np.array(seen) == np.array(known)) >= 0.98


def test_late_and_coarse_sight_catches_less() -> None:
    states = releases(300)

    def caught(**sensor: float) -> int:
        settings = learn_settings("hard", **{f"sensor__{name}": value for name, value in sensor.items()})
        rng = np.random.default_rng(1)
        return sum(caught_by_sight(state, settings, GAME, rng) for state in states)

    shipped = caught()
    assert caught(latency_s=0.3) < 0.95 * shipped
    assert caught(sigma_m=0.02) < 0.95 * shipped


def test_the_estimate_is_least_squares_with_the_reading_as_its_first_equations() -> None:
    rng, sigma, gravity = np.random.default_rng(2), 0.003, 9.81
    read = Ball(0.1, 0.3, -0.2, 2.0)
    estimate = FlightEstimate(read, gravity, 0.01, 0.1)
    t = np.linspace(0.0, 0.3, 12)
    seen = rng.normal(size=(12, 2))
    for t_s, row in zip(t, seen, strict=True):
        estimate.add(float(t_s), row.tolist(), sigma)
    design = np.vstack([[1 / 0.01, 0.0], [0.0, 1 / 0.1], *(np.array([1.0, t_s]) / sigma for t_s in t)])
    fall = np.array([0.0, -0.5 * gravity]) * t[:, None] ** 2
    first = np.array([[0.1, 0.3], [-0.2, 2.0]]) / [[0.01], [0.1]]
    expected = np.linalg.lstsq(design, np.vstack([first, (seen - fall) / sigma]), rcond=None)[0]
    found = estimate.ball(0.0)
    assert [found.across_m, found.above_m] == pytest.approx(expected[0].tolist())
    assert [found.across_m_s, found.above_m_s] == pytest.approx(expected[1].tolist())
    later = estimate.ball(0.2)
    assert later.above_m == pytest.approx(found.above_m + 0.2 * found.above_m_s - 0.5 * gravity * 0.04)


@pytest.mark.parametrize(("sigma_m", "rate_hz"), [(0.002, 60.0), (0.05, 100.0)])
def test_the_estimate_begins_with_the_noisy_reading_and_takes_late_measurements_of_the_true_ball(
    monkeypatch: pytest.MonkeyPatch, sigma_m: float, rate_hz: float
) -> None:
    """Errors are drawn as told: angle, rate, then two for each measurement; the rope is soon slack."""
    events: list[tuple[str, float, list[float]]] = []
    begun: list[tuple[Ball, float, float]] = []

    class Kept(FlightEstimate):
        def __init__(self, read: Ball, gravity_m_s2: float, sigma_m: float, sigma_m_s: float) -> None:
            assert gravity_m_s2 == GAME.gravity_m_s2
            begun.append((read, sigma_m, sigma_m_s))
            super().__init__(read, gravity_m_s2, sigma_m, sigma_m_s)

        def add(self, t_s: float, position_m: Iterable[float], sigma_m: float) -> None:
            events.append(("seen", t_s, [*position_m, sigma_m]))
            super().add(t_s, position_m, sigma_m)

        def ball(self, t_s: float) -> Ball:
            events.append(("now", t_s, []))
            return super().ball(t_s)

    monkeypatch.setattr(visual_flight, "FlightEstimate", Kept)
    noise = {"noise__angle_reading_deg": 2.0, "noise__rate_reading_rad_s": 0.1}
    sensor = {"sensor__sigma_m": sigma_m, "sensor__latency_s": 0.05, "sensor__rate_hz": rate_hz}
    settings = learn_settings("hard", **noise, **sensor)
    released, step_s = SwingState(0.05, 0.3, 2.2, 3.5), settings.step_s
    caught_by_sight(released, settings, GAME, np.random.default_rng(3))
    rng, rope = np.random.default_rng(3), TautRope.of(GAME)
    angle, rate = 2.2 + np.deg2rad(2.0) * rng.standard_normal(), 3.5 + 0.1 * rng.standard_normal()
    read, true, length = rope.ball(angle, rate), TautRope.hanging(GAME).ball(2.2, 3.5), GAME.rope.length_m
    ((found, first_m, first_m_s),) = begun
    expected = (0.05 + read.across_m, read.above_m, 0.3 + read.across_m_s, read.above_m_s)
    assert (found.across_m, found.above_m, found.across_m_s, found.above_m_s) == pytest.approx(expected)
    assert first_m == pytest.approx(max(length * np.deg2rad(2.0), sigma_m))
    assert first_m_s == pytest.approx(max(length * 0.1, sigma_m * rate_hz))
    seen = [(k, event) for k, event in enumerate(events) if event[0] == "seen"]
    assert len(seen) > 8
    for number, (k, (_, t_s, (x, z, sigma))) in enumerate(seen):
        assert t_s == pytest.approx(math.ceil(number / rate_hz / step_s - 1e-9) * step_s)
        now = next(t for kind, t, _ in events[k:] if kind == "now")
        assert now - step_s < t_s + 0.05 + 1e-9 <= now + 1e-9 + step_s * 1e-6
        assert sigma == sigma_m
        error = sigma_m * rng.standard_normal(2)
        across = 0.05 + true.across_m + (0.3 + true.across_m_s) * t_s
        above = true.above_m + true.above_m_s * t_s - GAME.gravity_m_s2 * t_s**2 / 2
        assert [x - error[0], z - error[1]] == pytest.approx([across, above], abs=2e-3 + 0.05 * t_s)
    times = [t for kind, t, _ in events if kind == "now"]
    assert times == pytest.approx(step_s * np.arange(len(times)))
