"""Random movement primitives."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from kendama_cli.artifacts.motion_plan import MotionPlan


@st.composite
def plans(draw: st.DrawFn) -> MotionPlan:
    """One to three coordinates, 3 to 25 basis functions, weights of the size that swings have."""
    c, m = draw(st.integers(1, 3)), draw(st.integers(3, 25))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    decay = draw(st.floats(0.5, 6.0))
    centers = np.exp(-decay * np.linspace(0.0, 1.0, m))
    return MotionPlan(
        coordinates=("x", "y", "z")[:c],
        duration_s=draw(st.floats(0.3, 5.0)),
        tau_scale=draw(st.floats(0.5, 2.0)),
        stiffness=draw(st.floats(50.0, 3000.0)),
        phase_decay=decay,
        start_m=rng.normal(size=c),
        start_velocity_m_s=rng.normal(size=c),
        goal_m=rng.normal(size=c),
        goal_velocity_m_s=rng.normal(size=c),
        weights=draw(st.floats(0.0, 300.0)) * rng.normal(size=(c, m)),
        centers=centers,
        widths=draw(st.floats(0.3, 2.0)) * np.abs(np.gradient(centers)),
        variation=rng.normal(size=(draw(st.integers(0, 3)), 1 + c * (3 + m))),
    )
