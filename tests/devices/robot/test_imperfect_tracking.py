from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.devices.robot.simulated import ImperfectTracking
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.robot import Imperfection
from tests.devices.robot.test_simulated import PERFECT

PERIOD_S = 0.004


def _told(errors: Imperfection, places_m: Array) -> Array:
    tracking = ImperfectTracking(errors, PERIOD_S, np.random.default_rng(10000))
    return np.array([tracking.tracked(place) for place in places_m])


def _counted(periods: int) -> Array:
    """Two markers that are at k in period k."""
    return np.arange(periods)[:, None, None] * np.ones((1, 2, 3))


def test_perfect_tracking_reports_what_is() -> None:
    assert np.array_equal(_told(PERFECT, _counted(5)), _counted(5))


def test_late_tracking_reports_what_was_the_delay_ago() -> None:
    told = _told(dataclasses.replace(PERFECT, tracking_delay_s=0.02), _counted(50))
    assert np.array_equal(told[5:], _counted(45))
    assert not told[:5].any()


def test_a_lost_reading_is_the_one_before_it_again() -> None:
    told = _told(dataclasses.replace(PERFECT, tracking_lost_fraction=0.1), _counted(4000))[:, 0, 0]
    same = np.diff(told) == 0
    # 0.1 of 4000, three standard deviations: 0.014
    assert float(same.mean()) == pytest.approx(0.1, abs=0.015)
    assert set(np.unique(np.arange(4000)[1:][~same] - told[1:][~same])) == {0.0}


def test_a_drift_has_its_size_and_forgets_itself_over_its_time() -> None:
    drift = _told(dataclasses.replace(PERFECT, drift_m=0.002, drift_s=0.1), np.zeros((20000, 2, 3))).reshape(-1, 6)
    # 80 s hold about 400 independent values in each of 6 series: 3 standard errors are 0.05 of the size
    assert float(drift.std()) == pytest.approx(0.002, rel=0.06)
    apart = round(0.1 / PERIOD_S)
    correlation = float((drift[apart:] * drift[:-apart]).mean() / drift.var())
    assert correlation == pytest.approx(np.exp(-1), abs=0.07)
