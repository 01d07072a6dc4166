"""Actions that an exploring rollout tries: a harmonic of its law, drawn and varied in the ranges that are set."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import solve_ivp

from kendama_cli.learning.exploration import (
    FOLLOWING_PER_S,
    DrawnHarmonic,
    EpsilonGreedy,
    Harmonic,
    draw_harmonic,
    explores,
    vary_harmonic,
)
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.statistics import LearningCount
from tests.learning.settings_files import learn_settings

LEARN = learn_settings("easy")


def driving(drives: str, **harmonic: Any) -> LearnSettings:
    """Settings with a thousand actions, so that the nearest is near."""
    settings = learn_settings("easy", actions_m_s2=np.linspace(-40.0, 40.0, 8001).tolist())
    return dataclasses.replace(settings, harmonic=dataclasses.replace(settings.harmonic, drives=drives, **harmonic))


def test_a_harmonic_drives_the_acceleration_or_the_largest_of_its_sign() -> None:
    drawn = DrawnHarmonic(5.0, 3.0, 0.4)
    for t_s in (0.0, 0.31, 2.2):
        wanted = 3.0 * math.cos(5.0 * t_s + 0.4)
        for bang_bang in (False, True):
            settings = driving("acceleration", bang_bang=bang_bang)
            chosen = settings.actions_m_s2[Harmonic(settings, drawn).action(t_s, SwingState(0, 0, 0, 0), 3)]
            assert chosen == pytest.approx(math.copysign(40.0, wanted) if bang_bang else wanted, abs=0.0051)


def test_a_cup_that_takes_these_actions_comes_to_the_harmonic_position_as_a_critically_damped_one() -> None:
    """The error e'' + 2 c e' + c^2 e = 0 falls from e0 as e0 (1 + c t) exp(-c t)."""
    settings = driving("position", bang_bang=False)
    harmonic, drawn = Harmonic(settings, DrawnHarmonic(5.0, 0.2, 0.4)), (5.0, 0.2, 0.4)
    w, size, phase = drawn
    begun = [size * math.cos(phase) + 0.1, -w * size * math.sin(phase)]

    def slope(t_s: float, state: np.ndarray) -> list[float]:
        chosen = harmonic.action(t_s, SwingState(float(state[0]), float(state[1]), 0.0, 0.0), 0)
        return [float(state[1]), settings.actions_m_s2[chosen]]

    times = np.linspace(0.0, 0.6, 7)
    found = solve_ivp(slope, (0.0, 0.6), begun, t_eval=times, max_step=0.02, rtol=1e-2).y[0]
    error = 0.1 * (1 + FOLLOWING_PER_S * times) * np.exp(-FOLLOWING_PER_S * times)
    assert found == pytest.approx(size * np.cos(w * times + phase) + error, abs=5e-4)


@pytest.mark.parametrize("drives", ["acceleration", "position"])
@pytest.mark.parametrize("phase", ["quarter", "any"])
def test_harmonics_are_drawn_evenly_from_their_ranges(drives: str, phase: str) -> None:
    settings, rng = driving(drives, phase=phase), np.random.default_rng(10016)
    drawn = np.array([draw_harmonic(settings, rng) for _ in range(500)])
    scale = settings.workspace.half_width_m if drives == "position" else 40.0
    low, high = scale * np.array(settings.harmonic.amplitude)
    slow, fast = settings.harmonic.band_rad_s
    assert stats.kstest(drawn[:, 0], stats.uniform(slow, fast - slow).cdf).pvalue > 1e-3
    assert stats.kstest(drawn[:, 1], stats.uniform(low, high - low).cdf).pvalue > 1e-3
    if phase == "quarter":
        assert set(drawn[:, 2]) == {-0.5 * math.pi, 0.5 * math.pi}
        assert abs((drawn[:, 2] > 0).mean() - 0.5) < 4 * 0.5 / math.sqrt(500)
    else:
        assert stats.kstest(drawn[:, 2], stats.uniform(0.0, 2 * math.pi).cdf).pvalue > 1e-3


def test_a_varied_harmonic_is_spread_normally_and_farther_until_anything_succeeds() -> None:
    """Relative changes of a fixed scale are normal; between two scales its logarithm is drawn evenly."""
    rng, begun = np.random.default_rng(10017), DrawnHarmonic(5.0, 3.0, 0.4)
    own = dataclasses.replace(LEARN.exploration, frequency_spread=0.1, amplitude_spread=0.2, spread_scales=(0.5, 8.0))

    def changes(succeeded: bool) -> np.ndarray:
        varied = [vary_harmonic(own, begun, rng, succeeded=succeeded) for _ in range(1000)]
        assert {one.phase_rad for one in varied} == {0.4}
        return np.array([[(one[0] / 5.0 - 1) / 0.1, (one[1] / 3.0 - 1) / 0.2] for one in varied])

    for column in changes(succeeded=True).T:
        assert stats.kstest(column, stats.norm.cdf).pvalue > 1e-3
    scales = 0.5 * 16.0 ** np.linspace(0, 1, 401)
    for column in changes(succeeded=False).T:
        assert stats.kstest(column, lambda x: stats.norm.cdf(x[:, None] / scales).mean(axis=1)).pvalue > 1e-3


def test_epsilon_fades_with_the_rollouts_and_every_action_is_as_likely() -> None:
    settings = dataclasses.replace(LEARN.exploration, epsilon=0.5, decay_rollouts=10)
    n = len(LEARN.actions_m_s2)
    for rollout, epsilon in ((0, 0.5), (10, 0.25)):
        explorer = EpsilonGreedy(settings, LEARN, rollout, np.random.default_rng(10018))
        counts = np.bincount([explorer.action(0.0, SwingState(0, 0, 0, 0), 0) for _ in range(2000)], minlength=n)
        assert stats.chisquare(counts[1:]).pvalue > 1e-3
        assert counts[1:].sum() / 2000 == pytest.approx(epsilon * (n - 1) / n, abs=4 * 0.5 / math.sqrt(2000))


def test_a_rollout_explores_before_any_success_and_then_as_often_as_a_failure_says() -> None:
    rng, failed = np.random.default_rng(10019), LearningCount(rollouts=9, succeeded_ever=True, greedy_failed=True)
    assert explores(0.0, LearningCount(), rng)
    assert np.mean([explores(0.3, failed, rng) for _ in range(1000)]) == pytest.approx(0.3, abs=0.06)
    for explored, rollouts, wanted in ((0, 9, False), (1, 9, True), (2, 9, True), (3, 9, False), (2, 2, False)):
        count = LearningCount(rollouts=rollouts, succeeded_ever=True, explored_in_a_row=explored)
        assert explores(1.0, count, rng, in_a_row=3) == wanted
