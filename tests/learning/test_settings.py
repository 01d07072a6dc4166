"""Wrong learning settings are refused in one line that names the key and what is allowed."""

from __future__ import annotations

import dataclasses

import pytest

from kendama_cli.config.site import find_site
from kendama_cli.errors import ConfigError
from kendama_cli.learning.discretisation import StateGrid
from kendama_cli.learning.state import SwingState
from kendama_cli.pipeline.catalogue import load_pipeline
from tests.learning.settings_files import learn_settings

WRONG = [
    ({"gamma": 1.1}, "'learn.gamma' is 1.1; allowed: at least 0 and at most 1"),
    ({"alpha": 0.0}, "'learn.alpha' is 0.0; allowed: above 0 and at most 1"),
    ({"grid__velocity_edges_m_s": [0.7, -0.7]}, "'learn.grid.velocity_edges_m_s' must rise from value to value"),
    ({"grid__rate_edges_rad_s": [0.5, 0.5]}, "'learn.grid.rate_edges_rad_s' must rise from value to value"),
    ({"grid__angle_bins": 0}, "'learn.grid.angle_bins' is 0; allowed: above 0"),
    ({"actions_m_s2": [8.0, 4.0, -8.0]}, "'learn.actions_m_s2' must rise from value to value"),
    ({"actions_m_s2": [0.0, 4.0]}, "'learn.actions_m_s2' is [0.0, 4.0]; allowed: at least one negative and one posit"),
    ({"workspace__half_width_m": 0.0}, "'learn.workspace.half_width_m' is 0.0; allowed: above 0"),
    ({"workspace__max_speed_m_s": 0.0}, "'learn.workspace.max_speed_m_s' is 0.0; allowed: above 0"),
    ({"workspace__braking_m_s2": 9.0}, "'learn.workspace.braking_m_s2' is 9.0; allowed: at most the maximum action"),
    ({"workspace__kind": "limt"}, "=limit'? Allowed: limit, terminate"),
    ({"harmonic__band_rad_s": [8.0, 3.0]}, "'learn.harmonic.band_rad_s' is [8.0, 3.0]; allowed: [low, high]"),
    (
        {"randomisation__drag": [2.0, 1.0]},
        "'learn.randomisation.drag' is [2.0, 1.0]; allowed: [low, high] with low <= high",
    ),
    ({"randomisation__delay_s": 0.03}, "'learn.randomisation.delay_s' is 0.03; allowed: at most decision.min_s, 0.02"),
    ({"goal__success": "cauht"}, "=caught'? Allowed: caught, catchable, reached"),
    ({"goal__max_rate_rad_s": 0.5}, "'learn.goal.max_rate_rad_s' is 0.5; allowed: above min_rate_rad_s, which is 1.0"),
    ({"decision__max_s": 0.01}, "'learn.decision.max_s' is 0.01; allowed: at least min_s"),
    ({"step_s": 0.05}, "'learn.step_s' is 0.05; allowed: at most decision.min_s, 0.02"),
    ({"rollout_s": 0.05}, "'learn.rollout_s' is 0.05; allowed: at least decision.max_s, 0.1"),
    ({"count__max_rollouts": 5}, "'learn.count.max_rollouts' is 5; allowed: at least learned_streak, which is 10"),
    ({"count__solved_streak": 5}, "'learn.count.solved_streak' is 5; allowed: at least learned_streak, which is 10"),
    ({"update": "sarsaa"}, "'learn.update' is 'sarsaa', did you mean 'learn.update=sarsa'? Allowed: sarsa, q"),
    (
        {"grid__position": "mirrored", "actions_m_s2": [-8.0, -4.0, 0.0, 4.0, 7.0]},
        "'learn.actions_m_s2' is [-8.0, -4.0, 0.0, 4.0, 7.0]; allowed where 'grid.position' is mirrored: with each",
    ),
    ({"alph": 0.5}, "unknown key 'learn.alph', did you mean 'learn.alpha'?"),
]


@pytest.mark.parametrize(("replaced", "message"), WRONG, ids=[next(iter(replaced)) for replaced, _ in WRONG])
def test_a_wrong_value_is_refused_with_its_key_and_what_is_allowed(replaced, message):
    with pytest.raises(ConfigError) as refused:
        learn_settings(**replaced)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)
    assert refused.value.key.startswith("learn.")


@pytest.mark.parametrize("name", ["easy", "hard", "hard_random", "paper_caught", "paper_literal"])
def test_the_shipped_settings_are_sound(name):
    assert len(learn_settings(name).actions_m_s2) == 5


def test_hard_random_is_hard_on_other_bodies():
    hard, varied = learn_settings("hard"), learn_settings("hard_random")
    assert varied.randomisation != hard.randomisation
    assert varied.validation.randomisation == varied.randomisation
    back = dataclasses.replace(hard.validation, randomisation=hard.randomisation)
    more = dataclasses.replace(hard.exploration, in_a_row=2)
    assert dataclasses.replace(hard, exploration=more) == dataclasses.replace(
        varied, task="hard", randomisation=hard.randomisation, validation=back, acting="latest"
    )


def test_the_papers_task_is_what_the_paper_tells():
    """Each value stands in the paper: numbers of bins and actions, harmonics without memory, what is rewarded."""
    literal = learn_settings("paper_literal")
    grid = StateGrid(literal.grid)
    assert (grid.shape, literal.grid.position) == ((2, 3, 18, 3), "side")
    assert grid.cell(SwingState(-0.01, 0.0, 0.0, 0.0))[0] != grid.cell(SwingState(0.01, 0.0, 0.0, 0.0))[0]
    assert len(literal.actions_m_s2) == 5
    assert (literal.exploration.kind, literal.exploration.mutation_fraction) == ("harmonic", 0.0)
    assert (literal.goal.success, literal.acting, literal.update) == ("reached", "latest", "sarsa")
    on_the_way = literal.reward.step, literal.reward.displacement_per_m, literal.reward.missed
    assert on_the_way == (0.0, 0.0, 0.0), "the final state is rewarded"
    assert literal.workspace.kind == "terminate"
    assert literal.reward.outside < 0.0, "too large a displacement is penalised"
    overrides = load_pipeline("paper", find_site().pipeline_folders).overrides
    assert {"learn/task=paper_literal", "game/air=linear", "encode=paper"} <= set(overrides)


def test_the_learner_is_a_choice_of_its_own_on_every_task():
    for name in ("easy", "hard"):
        plain, other = learn_settings(name), learn_settings(name, "learn/learner=epsilon_greedy")
        assert (plain.exploration.kind, other.exploration.kind) == ("harmonic", "epsilon_greedy")
        assert dataclasses.replace(other, exploration=plain.exploration) == plain


def test_a_longer_rope_meets_a_narrower_workspace():
    """By similarity lengths go with the rope and speeds with its root; nothing else changes."""
    whole = learn_settings()
    narrow = whole.with_workspace_scale(0.81)
    assert narrow.workspace.half_width_m == pytest.approx(0.81 * whole.workspace.half_width_m)
    assert narrow.workspace.max_speed_m_s == pytest.approx(0.9 * whole.workspace.max_speed_m_s)
    assert narrow.goal.landing_limit_m == pytest.approx(0.81 * whole.goal.landing_limit_m)
    back = narrow.with_workspace_scale(1 / 0.81)
    assert dataclasses.replace(back, workspace=whole.workspace, goal=whole.goal) == whole
    assert whole.with_workspace_scale(1.0) == whole
