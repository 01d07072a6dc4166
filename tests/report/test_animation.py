from __future__ import annotations

import json
import re

import numpy as np
import pytest

from kendama_cli.errors import InputError
from kendama_cli.report.animation import Ahead, player
from kendama_cli.report.source import StageLog
from kendama_cli.report.tracks import Geometry, Path2D
from tests.simulation.dart.bench_robot import kendama_game


def _drop_px(gravity_m_s2: float) -> float:
    """How much higher the parabola ahead ends than it begins, over its scale: the ball at rest at the crossing."""
    t = np.linspace(0.0, 1.0, 11)
    still = Path2D(t, 0 * t, 0 * t, 0 * t)
    sizes = Geometry(0.4, 0.02, kendama_game().cup, gravity_m_s2)
    ahead = Ahead(t_s=0.0, crossing_s=2.0, x_m=0.0, x_m_s=0.0, z_m=0.0, z_m_s=0.0, sigma_m=0.01)
    film = player("one", still, still, sizes, poster_s=0.0, autoplay=False, predictions=[ahead])
    data = json.loads(re.search(r'application/json">(.*?)</script>', film)[1])
    _, begin, _, _, _, end, _, _ = data["ahead"][0]
    return float(end - begin)


def test_the_way_ahead_falls_as_the_run_s_own_gravity_says() -> None:
    """Before, it was drawn with 9.81 m/s^2 wherever the game was."""
    assert _drop_px(1.62) / _drop_px(9.81) == pytest.approx(1.62 / 9.81, rel=1e-3)


def test_a_log_without_the_game_s_sizes_is_refused_by_name() -> None:
    """Before, the sizes of conf/game/kendama.yaml were drawn instead."""
    log = StageLog.__new__(StageLog)
    log.path, log.settings = "adapt.mcap", {"rope": {"length_m": 0.4}}
    with pytest.raises(InputError, match=r"adapt.mcap: has no setting 'ball.radius_m'; run the stage again"):
        Geometry.of(log)
