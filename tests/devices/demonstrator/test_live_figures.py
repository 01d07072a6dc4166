"""Figures of a stream for who watches it: its rate, its gaps and its delay."""

from __future__ import annotations

import pytest

from kendama_cli.devices.demonstrator.live_figures import LiveFigures


def test_rate_gaps_and_delay_of_a_stream_are_those_that_it_has() -> None:
    """100 poses a second, 20 ms under way, of which 5 are missing at 1.2 s."""
    told = []
    figures = LiveFigures(lambda done, total, **named: told.append((done, total, named)), 3.0)
    for k in range(301):
        if not 120 <= k < 125:
            figures.add(0.01 * k + 0.02, 0.01 * k)
    assert [done for done, _, _ in told] == [0, 1, 1, 2, 2, 2]
    assert {total for _, total, _ in told} == {3}
    first, last = told[0][2], told[-1][2]
    assert first == {"rate_hz": pytest.approx(100.0), "gaps": 0, "longest_step_ms": 10.0, "delay_ms": 20.0}
    assert last == {"rate_hz": pytest.approx(100.0), "gaps": 1, "longest_step_ms": 60.0, "delay_ms": 20.0}


def test_images_without_stamps_have_no_delay() -> None:
    told = []
    figures = LiveFigures(lambda done, total, **named: told.append(named), 10.0)
    for k in range(40):
        figures.add(k / 30)
    assert told[0] == {"rate_hz": pytest.approx(30.0), "gaps": 0, "longest_step_ms": pytest.approx(33.3)}
