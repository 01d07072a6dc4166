"""Success of a table on other bodies than the one it was learned on."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.config.compose import composed
from kendama_cli.config.site import find_site
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.stages.learn.stage import Learn
from tests.memory_context import MemoryContext
from tests.stages.transfer_setup import FULL, GAME, LEARN, stage


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_table_saves_rollouts_on_other_bodies(tmp_path: Path) -> None:
    """In 36 transfers over nine twins every table reached the goal at once and always, from scratch took 2 to 28.

    Among 70 other tables 2 were weak on several of the nine: there some 5 to 15 rollouts are needed.
    """
    settings = dataclasses.replace(FULL, evaluation_rollouts=12, max_rollouts=100, games=1, baseline=True)
    quick = dataclasses.replace(LEARN, count=dataclasses.replace(LEARN.count, evaluation_rollouts=1))
    made = []
    for twin in ("twin_long_slow", "twin_rope_short", "twin_noise_3"):
        chosen = composed(find_site(tmp_path), [f"hardware={twin}"])["hardware"]
        hardware = build_value(HardwareSettings, chosen, "hardware")
        for seed in range(50, 53):
            table = Learn(learn=quick, game=GAME).run({}, MemoryContext(seed)).artifact
            made.append(stage(settings, hardware).run({"learn": table}, MemoryContext(seed)).metrics)
    given = np.array([int(metrics["rollouts"] or 0) for metrics in made]).reshape(3, 3)
    scratch = np.array([int(metrics["rollouts_from_scratch"] or 0) for metrics in made]).reshape(3, 3)
    assert given.mean() <= 3.0
    assert (given.mean(axis=1) < scratch.mean(axis=1)).all(), (given, scratch)
    assert np.mean([float(metrics["success_rate_before"] or 0.0) for metrics in made]) >= 0.9
    assert np.mean([float(metrics["success_rate_after"] or 0.0) for metrics in made]) >= 0.95
