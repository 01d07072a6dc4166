"""The first view of a replay: from where the arm stands behind cup and ball."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.report.replay.performance import Frames, Performance
from kendama_cli.report.replay.viewpoint import USUAL_RAD, azimuth_rad


def _standing(azimuth: float | None) -> Performance:
    """A cup and a ball at rest, and an arm of one link half a metre from them at ``azimuth``; None: no arm."""
    turn = [1.0, 0.0, 0.0, 0.0]
    bodies = np.array([[[0.0, 0.0, 1.0, *turn], [0.0, 0.0, 0.8, *turn]]] * 10)
    if azimuth is None:
        return Performance("alone", "simulation", Frames(("cup", "ball"), 0.0, 100.0, bodies))
    x, y = 0.5 * math.cos(azimuth), 0.5 * math.sin(azimuth)
    links = np.array([[[x, y, 0.0, *turn], [x, y, 2.0, *turn]]] * 10)
    return Performance(
        "arm",
        "simulation",
        Frames(("cup", "ball"), 0.0, 100.0, bodies),
        Frames(("base", "tip"), 0.0, 100.0, links),
    )


def test_an_arm_that_hides_nothing_leaves_the_usual_view() -> None:
    assert azimuth_rad([_standing(None)]) == USUAL_RAD
    assert azimuth_rad([_standing(-math.pi / 2)]) == USUAL_RAD


@pytest.mark.parametrize("turn_deg", [-15, 0, 15])
def test_the_view_turns_away_from_an_arm_in_front(turn_deg: float) -> None:
    """Seen from within 10 degrees of its azimuth, a link of 0.09 m at 0.5 m hides what is behind it."""
    stands = USUAL_RAD + math.radians(turn_deg)
    assert abs(azimuth_rad([_standing(stands)]) - stands) >= math.asin(0.09 / 0.5) - 1e-9
