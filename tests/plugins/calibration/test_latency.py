"""A camera's delay is found within its told interval; what is no film of the light is refused."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.plugins.calibration.latency import Blinks, measure_delay

DELAY_S = 0.037


def random_switches(seed: int, count: int) -> np.ndarray:
    """Times at which the light of blink.html may switch: it stays for 60 to 240 ms, at random."""
    return np.cumsum(np.random.default_rng(seed).uniform(0.06, 0.24, count))


def film(
    seed: int, rate_hz: float, *, exposure_s: float = 0.004, jitter_s: float = 0.0, lost: float = 0.0, n: int = 120
) -> tuple[Blinks, np.ndarray, np.ndarray]:
    """Stamps and brightness of a light that was integrated over each exposure in 200 parts, with shot noise."""
    rng = np.random.default_rng(seed)
    switches = 3.0 + random_switches(seed + 1, n)
    middles = 2.0 + rng.uniform(0, 1 / rate_hz) + np.arange(0, switches[-1], 1 / rate_hz)
    parts = middles[:, None] + exposure_s * (np.arange(200) / 200 - 0.4975)
    on = np.searchsorted(switches, parts) % 2 == 1
    brightness = 30 + 150 * on.mean(axis=1) + 3 * rng.standard_normal(len(middles))
    stamps = middles + DELAY_S + jitter_s * rng.standard_normal(len(middles))
    kept = rng.random(len(middles)) >= lost
    return Blinks(switches), stamps[kept], brightness[kept]


@pytest.mark.parametrize("rate_hz", [60.0, 120.0])
@pytest.mark.parametrize(("jitter_s", "lost"), [(0.0, 0.0), (0.002, 0.1), (0.004, 0.3)])
def test_a_known_delay_is_found_within_its_interval(rate_hz: float, jitter_s: float, lost: float) -> None:
    """An interval of 95 % misses one in twenty: of eight films two misses have a chance of 6 %, three of 0.6 %."""
    found = [measure_delay(*film(10000 + k, rate_hz, jitter_s=jitter_s, lost=lost)) for k in range(8)]
    held = sum(one.low_s <= DELAY_S <= one.high_s for one in found)
    assert held >= 6
    assert max(one.high_s - one.low_s for one in found) < 0.004
    assert max(abs(one.delay_s - DELAY_S) for one in found) < 0.002


def test_a_long_exposure_does_not_move_its_middle() -> None:
    found = measure_delay(*film(10020, 60.0, exposure_s=0.016))
    assert found.delay_s == pytest.approx(DELAY_S, abs=0.001)
    assert found.width_s > 0.011


def test_more_switches_make_the_interval_narrower() -> None:
    few, many = (measure_delay(*film(10030, 60.0, n=n)) for n in (60, 480))
    assert many.sigma_s < 0.6 * few.sigma_s


def test_a_film_of_something_else_is_refused() -> None:
    blinks, stamps, brightness = film(10040, 60.0)
    with pytest.raises(ValueError, match=r"the light explains \d+% of the images' brightness; needed: 60%"):
        measure_delay(Blinks(3.0 + random_switches(7, 120)), stamps, brightness)
    with pytest.raises(ValueError, match="the light explains"):
        measure_delay(blinks, stamps, -brightness)
    with pytest.raises(ValueError, match="the light explains 0% of"):
        measure_delay(blinks, stamps, np.full(len(stamps), 60.0))


def test_another_clock_or_a_short_film_is_refused() -> None:
    blinks, stamps, brightness = film(10050, 60.0)
    with pytest.raises(ValueError, match=r"switches 0 times while images came; needed: 30"):
        measure_delay(blinks, stamps + 1e6, brightness)
    with pytest.raises(ValueError, match=r"switches \d+ times while images came"):
        measure_delay(blinks, stamps[:200], brightness[:200])
