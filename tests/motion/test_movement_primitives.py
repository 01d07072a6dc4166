"""Held against another implementation: dfki-ric/movement_primitives, where it is installed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.dmp.averaging import encode, prepare
from kendama_cli.motion.dmp.primitive import play
from tests.motion.swings import path, settings

peer: Any = pytest.importorskip("movement_primitives.dmp", reason="needs movement_primitives (pip install '.[test]')")


@pytest.mark.parametrize(("begin_s", "end_s"), [(0.0, 2.0), (0.55, 1.35)], ids=["at rest", "moving"])
def test_both_make_the_same_motion_within_the_others_own_error(begin_s: float, end_s: float) -> None:
    """Its error is its distance from the demonstration; ours is less, so the two are no farther apart than both."""
    dt = 0.001
    t = np.arange(round((end_s - begin_s) / dt) + 1) * dt
    position = path(begin_s + t) - path(np.array([begin_s]))
    other = peer.DMP(n_dims=3, execution_time=t[-1], dt=dt, n_weights_per_dim=20)
    other.imitate(t, position)
    _, theirs = other.open_loop(run_t=t[-1])
    theirs = theirs[: len(t)]
    chosen = settings(trim="none")
    made = encode(prepare([Demonstration("swing", t, position)], chosen), chosen)
    ours = play(made.plan(0), t).position_m + made.parameters.origin_m[0]

    def rms(difference: np.ndarray) -> float:
        return float(np.sqrt(np.mean(np.sum(difference**2, axis=1))))

    own_error, their_error = rms(ours - position), rms(theirs - position)
    assert own_error < their_error
    assert rms(ours - theirs) <= own_error + their_error
    assert rms(ours - theirs) < 0.02
