"""A marker on the handle of a cup that the wrist turns, in a rendered phone film of a swing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kendama_cli.devices.demonstrator.interface import open_demonstrators
from tests.plugins.films.swing_film import person_swing, write_film
from tests.plugins.marker.handle_film import MARKER_TO_CUP_M, PHONE, filmed_with_marker
from tests.plugins.marker.test_films import settings


@pytest.mark.slow
def test_a_swing_is_read_without_a_lens_where_the_tie_point_is_told(tmp_path):
    """The marker is 20 px wide, as one of 40 mm from 2 m in 720p."""
    shoot = replace(PHONE, width_px=560, height_px=640, focal_px=500.0, away_m=1.0)
    path, swing = tmp_path / "swing.mp4", person_swing(12)
    write_film(path, filmed_with_marker(12, shoot), shoot.rate_hz)

    def read(**changes):
        told = []
        own = settings(path, field_of_view_deg=None, **changes)
        (hand,) = open_demonstrators(own, lambda done, total: told.append(done))
        samples = list(hand.samples())
        t_s, place_m = np.array([one.t_s for one in samples]), np.array([one.position_m for one in samples])
        assert told == list(range(1, 1 + len(told)))
        assert len(told) >= len(samples) > 60
        starts = np.arange(0.0, 0.6, 0.005)
        true_m = [np.column_stack([np.interp(t_s + one, swing.t_s, path) for path in swing.cup_m.T]) for one in starts]
        rms_m = [(place_m - one).std(axis=0) for one in true_m]
        return 1e3 * min(rms_m, key=lambda one: one[0] + one[2]), hand.warnings

    error_mm, told = read(marker_to_cup_m=MARKER_TO_CUP_M.tolist())
    assert error_mm[[0, 2]].max() < 1.5
    assert error_mm[1] < 8
    assert not any("measure capture.marker_to_cup_m" in one for one in told)
    without_mm, told = read()
    assert without_mm[0] > 2 * error_mm[0]
    assert any("the marker turns by 1" in one for one in told)
