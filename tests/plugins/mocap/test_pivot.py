"""A body that is turned about a point tells where that point is in it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kendama_cli.plugins.mocap.pivot import calibrate_pivot

OFFSET, PLACE = np.array([0.02, -0.01, 0.15]), np.array([0.3, 0.1, 1.0])


def turned(rng, degrees, axes=(1.0, 1.0, 0.3), count=400):
    return Rotation.from_rotvec(np.radians(degrees) * rng.uniform(-1, 1, (count, 3)) * axes)


@pytest.mark.parametrize("seed", range(10000, 10005))
def test_the_offset_is_found_within_its_own_uncertainty(seed):
    rng = np.random.default_rng(seed)
    turns = turned(rng, 40)
    places = PLACE - turns.apply(OFFSET) + rng.normal(0, 5e-4, (400, 3))
    places[7] += 0.05  # a ghost marker
    made = calibrate_pivot(places, turns.as_quat(scalar_first=True))
    assert np.all(np.abs(made.offset_m - OFFSET) < 5 * made.sigma_m)  # 5 sigma over 15 values
    assert made.rms_m == pytest.approx(5e-4 * np.sqrt(3), rel=0.15)
    assert made.used == 399


def test_a_body_turned_about_one_axis_is_refused():
    rng = np.random.default_rng(10000)
    turns = turned(rng, 40, axes=(1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="turn it by 30 deg or more to all sides"):
        calibrate_pivot(PLACE - turns.apply(OFFSET), turns.as_quat(scalar_first=True))
