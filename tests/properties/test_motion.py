"""Invariances of the movement primitive, for random plans."""

from __future__ import annotations

import dataclasses

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.dmp.plan_text import TextFormat, plan_from_text, plan_text
from kendama_cli.motion.dmp.primitive import play
from tests.properties.plans import plans

shares = np.linspace(-0.1, 1.3, 57)


@given(plans(), st.floats(0.5, 2.0))
def test_tau_stretches_time_and_nothing_else(plan: MotionPlan, scale: float) -> None:
    slower = dataclasses.replace(plan, tau_scale=scale * plan.tau_scale)
    once = play(plan, shares * plan.tau_scale * plan.duration_s)
    again = play(slower, shares * slower.tau_scale * slower.duration_s)
    size = 1.0 + np.abs(once.position_m).max()
    np.testing.assert_allclose(again.position_m, once.position_m, atol=1e-9 * size)
    speed = 1.0 + np.abs(once.velocity_m_s).max()
    np.testing.assert_allclose(scale * again.velocity_m_s, once.velocity_m_s, atol=1e-9 * speed)


@given(plans(), st.tuples(*[st.floats(-5.0, 5.0)] * 3))
def test_a_shifted_plan_is_played_shifted(plan: MotionPlan, shift: tuple[float, ...]) -> None:
    by = np.array(shift)[: len(plan.start_m)]
    moved = dataclasses.replace(plan, start_m=plan.start_m + by, goal_m=plan.goal_m + by)
    t_s = shares * plan.tau_scale * plan.duration_s
    once, again = play(plan, t_s), play(moved, t_s)
    size = 1.0 + np.abs(once.position_m).max()
    np.testing.assert_allclose(again.position_m, once.position_m + by, atol=1e-9 * size)


@given(plans(), st.floats(-3.0, 3.0))
def test_a_scaled_plan_is_played_scaled(plan: MotionPlan, scale: float) -> None:
    names = ("start_m", "goal_m", "weights", "start_velocity_m_s", "goal_velocity_m_s")
    scaled = dataclasses.replace(plan, **{name: scale * getattr(plan, name) for name in names})
    t_s = shares * plan.tau_scale * plan.duration_s
    once, again = play(plan, t_s), play(scaled, t_s)
    size = 1.0 + np.abs(once.position_m).max()
    np.testing.assert_allclose(again.position_m, scale * once.position_m, atol=1e-9 * size)


@given(plans(), st.sampled_from(["json", "yaml"]))
def test_a_plan_comes_back_from_its_text_to_the_last_bit(plan: MotionPlan, form: TextFormat) -> None:
    again = plan_from_text(plan_text(plan, form), form)
    for field in dataclasses.fields(plan):
        before, after = getattr(plan, field.name), getattr(again, field.name)
        if isinstance(before, np.ndarray):
            assert before.tobytes() == after.tobytes(), field.name
        else:
            assert before == after, field.name
