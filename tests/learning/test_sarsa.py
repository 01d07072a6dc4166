"""The learner as it is driven from outside: decisions in time, counting, saving, policies."""

from __future__ import annotations

import json

import numpy as np
import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.learning.decision import GreedyPolicy, seal_table, task_meaning
from kendama_cli.learning.sarsa import SarsaLearner, ValueTable
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.updates import Transition, UpdateName
from kendama_cli.schema.json_text import json_text
from tests.learning.settings_files import learn_settings
from tests.learning.textbook import Walk

COSTLY = {"reward__step": -0.2, "reward__displacement_per_m": 100.0, "reward__displacement_free_m": 0.3}
HANGING = SwingState(0.0, 0.0, 0.0, 0.0)
SWUNG = SwingState(0.0, 0.0, 1.0, 0.0)
SETTINGS = learn_settings()


def preferring(*columns: int) -> np.ndarray:
    """A table that prefers columns[0] hanging and columns[1] swung out."""
    q = np.zeros((324, 5))
    policy = SarsaLearner(SETTINGS)._grid
    for state, column in zip((HANGING, SWUNG), columns, strict=False):
        q[policy.row(state), column] = 1.0
    return q


def test_an_action_is_held_for_the_shortest_time_even_if_the_state_changes():
    policy = GreedyPolicy(seal_table(preferring(0, 4), SETTINGS), SETTINGS)
    assert policy.act(HANGING, 0.0) == -8.0
    assert policy.act(SWUNG, 0.018) == -8.0
    assert policy.act(SWUNG, 0.020) == 8.0


def test_the_learner_and_the_frozen_policy_of_its_table_act_alike():
    q = preferring(1, 3)
    learner = SarsaLearner(SETTINGS, q=q)
    learner.begin_rollout(np.random.default_rng(0))
    policy = GreedyPolicy(seal_table(q, SETTINGS), SETTINGS)
    assert not learner.explored
    for k in range(30):
        state = HANGING if k // 7 % 2 else SWUNG
        assert learner.act(state, k * 0.002) == policy.act(state, k * 0.002)
        assert learner.next_look_s == policy.next_look_s


def test_in_the_same_state_a_new_choice_comes_after_the_longest_time():
    learner = SarsaLearner(SETTINGS, q=np.zeros((324, 5)))
    learner.begin_rollout(np.random.default_rng(0))
    chosen = []
    for k in range(101):
        learner.act(HANGING, k * 0.002)
        if not chosen or learner.next_look_s != chosen[-1]:
            chosen.append(learner.next_look_s)
    assert [round(look_s - 0.02, 6) for look_s in chosen] == [0.0, 0.1, 0.2]


def test_ties_keep_the_previous_action_and_the_first_is_to_rest():
    policy = GreedyPolicy(seal_table(np.zeros((324, 5)), SETTINGS), SETTINGS)
    assert policy.act(HANGING, 0.0) == 0.0


def test_success_raises_and_timeout_lowers_what_was_tried():
    for outcome, sign in (("goal", 1), ("timeout", -1)):
        learner = SarsaLearner(SETTINGS, q=np.full((324, 5), 5.0))
        learner.begin_rollout(np.random.default_rng(0))
        learner.act(HANGING, 0.0)
        learner.end_rollout(outcome, HANGING)
        change = learner.table - 5.0
        assert np.count_nonzero(change) == 1
        assert np.sign(change.sum()) == sign


def test_the_reward_of_a_rollout_is_that_of_its_actions_and_its_end():
    settings = learn_settings(
        "paper_caught", reward__step=-0.2, reward__displacement_per_m=100.0, reward__displacement_free_m=0.3
    )
    learner = SarsaLearner(settings, q=np.zeros((324, 5)))
    learner.begin_rollout(np.random.default_rng(0))
    far = SwingState(0.35, 0.0, 0.0, 0.0)
    for k in range(3):
        learner.act(far, 0.1 * k)
    finished = learner.end_rollout("outside", far)
    assert finished.actions == 3
    assert finished.reward == pytest.approx(3 * (-0.2 - 100.0 * 0.05) - 30.0)


def test_it_explores_until_the_first_success_and_then_only_after_greedy_failures():
    learner = SarsaLearner(learn_settings(exploration__after_failure=1.0))
    rng = np.random.default_rng(0)
    explored = []
    for outcome in ("timeout", "timeout", "goal", "goal", "timeout", "goal"):
        learner.begin_rollout(rng)
        explored.append(learner.explored)
        learner.act(HANGING, 0.0)
        learner.end_rollout(outcome, HANGING)
    assert explored == [True, True, True, False, False, True]


def test_as_many_rollouts_explore_after_a_greedy_failure_as_are_configured():
    learner, rng = SarsaLearner(learn_settings(exploration__in_a_row=3)), np.random.default_rng(0)
    explored = []
    for outcome in ("timeout", "goal", "timeout", "goal", "goal", "timeout", "goal", "timeout"):
        learner.begin_rollout(rng)
        explored.append(learner.explored)
        learner.act(HANGING, 0.0)
        learner.end_rollout(outcome, HANGING)
    assert explored == [True, True, False, True, True, True, False, False]


@pytest.mark.parametrize("acting", ["latest", "streak_mean"])
@pytest.mark.parametrize("update", ["sarsa", "q"])
def test_from_state_goes_on_bit_for_bit(update, acting):
    settings = learn_settings(update=update, acting=acting)

    def rollouts(learner: SarsaLearner, rng: np.random.Generator, n: int) -> None:
        for k in range(n):
            learner.begin_rollout(rng)
            for step in range(20):
                learner.act(SwingState(0.1 * step, 0.0, rng.normal(), 0.0), 0.1 * step)
            learner.end_rollout("goal" if k % 3 else "timeout", HANGING)

    whole, rng = SarsaLearner(settings), np.random.default_rng(1)
    rollouts(whole, rng, 8)
    half, rng = SarsaLearner(settings), np.random.default_rng(1)
    rollouts(half, rng, 3)
    saved = half.state()
    tables = {name: saved.pop(name) for name in ("q", "best", "mean") if name in saved}
    resumed = SarsaLearner.from_state(settings, {**tables, **json.loads(json.dumps(saved))})
    for k in range(3, 8):
        resumed.begin_rollout(rng)
        for step in range(20):
            resumed.act(SwingState(0.1 * step, 0.0, rng.normal(), 0.0), 0.1 * step)
        resumed.end_rollout("goal" if k % 3 else "timeout", HANGING)
    np.testing.assert_array_equal(resumed.table, whole.table)
    assert resumed.policy.digest == whole.policy.digest
    assert resumed.count == whole.count


def mirror(state: SwingState) -> SwingState:
    return SwingState(*(-part for part in state))


def test_on_a_mirrored_grid_the_mirror_image_is_answered_by_the_opposite_and_teaches_the_same():
    settings = learn_settings("paper_caught", alpha=0.5)
    rng = np.random.default_rng(4)
    states = [SwingState(*rng.normal(0.0, (0.2, 0.5, 1.5, 3.0))) for _ in range(60)]
    q = rng.normal(size=(324, 5))
    here, there = SarsaLearner(settings, q=q), SarsaLearner(settings, q=q)
    for learner in (here, there):
        learner.begin_rollout(np.random.default_rng(0))
    actions = [here.act(state, 0.02 * k) for k, state in enumerate(states)]
    assert [there.act(mirror(state), 0.02 * k) for k, state in enumerate(states)] == [-action for action in actions]
    assert len(set(actions)) == 5
    here.end_rollout("goal", states[-1])
    there.end_rollout("goal", mirror(states[-1]))
    np.testing.assert_array_equal(there.table, here.table)
    assert (here.table != q).any()


def test_from_the_tenth_success_on_the_table_is_frozen_until_a_failure():
    learner = SarsaLearner(SETTINGS, q=np.zeros((324, 5)))
    changed = []
    for outcome in ["goal"] * 12 + ["timeout"] * 2:
        before = learner.table
        learner.begin_rollout(np.random.default_rng(0))
        learner.act(HANGING, 0.0)
        learner.end_rollout(outcome, HANGING)
        changed.append(bool((learner.table != before).any()))
    assert changed == [True] * 10 + [False] * 3 + [True]


def test_the_policy_is_the_table_with_the_longest_streak_while_it_was_frozen():
    never = learn_settings(exploration__after_failure=0.0)
    learner, rng = SarsaLearner(never, q=preferring(0, 4)), np.random.default_rng(0)

    def play(results: str) -> np.ndarray:
        nonlocal learner
        for result in results:
            learner.begin_rollout(rng)
            learner.act(HANGING, 0.0)
            learner.end_rollout("goal" if result == "g" else "timeout", SWUNG)
            learner = SarsaLearner.from_state(never, learner.state())
        return np.asarray(learner.policy.array("q"))

    first = play("f" + "g" * 15)
    np.testing.assert_array_equal(first, learner.table)
    second = play("f" + "ff" + "g" * 12)
    assert np.any(learner.table != first)
    np.testing.assert_array_equal(second, first)
    np.testing.assert_array_equal(play("f" + "f"), first)
    third = play("g" * 17)
    np.testing.assert_array_equal(third, learner.table)
    np.testing.assert_array_equal(play("fff"), third)


@pytest.mark.parametrize(("name", "driven"), [("easy", "acceleration"), ("paper_caught", "position")])
def test_what_a_harmonic_drives_suits_the_workspace(name, driven):
    def actions(drives: str) -> list[float]:
        learner = SarsaLearner(learn_settings(name, harmonic__drives=drives))
        learner.begin_rollout(np.random.default_rng(3))
        return [learner.act(SWUNG if k % 2 else HANGING, 0.02 * k) for k in range(100)]

    other = {"acceleration": "position", "position": "acceleration"}[driven]
    assert actions("auto") == actions(driven) != actions(other)


def test_replay_changes_the_table_but_not_the_count():
    tables = []
    for passes in (0, 4):
        learner = SarsaLearner(learn_settings(replay_passes=passes))
        learner.begin_rollout(np.random.default_rng(0))
        learner.act(HANGING, 0.0)
        learner.act(SWUNG, 0.1)
        learner.end_rollout("goal", SWUNG)
        tables.append(learner.table)
        assert learner.count.rollouts == 1
    assert (tables[1] >= tables[0]).all()
    assert (tables[1] > tables[0]).any()


def test_a_table_of_another_shape_is_refused():
    with pytest.raises(ValueError, match=r"the table has shape \(3, 5\); the configuration 'learn' needs \(324, 5\)"):
        SarsaLearner(SETTINGS, q=np.zeros((3, 5)))
    with pytest.raises(ValueError, match=r"the table has shape \(324, 4\)"):
        GreedyPolicy(seal_table(np.zeros((324, 4)), SETTINGS), SETTINGS)


def test_the_policy_is_sealed_with_what_gives_it_its_meaning_and_with_nothing_else():
    sealed = SarsaLearner(SETTINGS).policy
    assert sealed.digest == seal_table(sealed.array("q"), SETTINGS).digest
    assert set(json.loads(sealed.meaning)) == {"task", "grid", "decision", "goal", "actions_m_s2"}
    assert json_text(task_meaning(learn_settings(alpha=0.1))) == sealed.meaning
    assert json_text(task_meaning(learn_settings(grid__rate_edges_rad_s=[-1.0, 1.0]))) != sealed.meaning


def test_exploration_varies_the_harmonics_with_the_best_rewards_and_keeps_them_over_a_restart():
    settings = learn_settings("hard", exploration__mutation_fraction=1.0, exploration__elite_size=2)
    learner, rng = SarsaLearner(settings), np.random.default_rng(0)
    sampled = []
    for miss_m in (0.25, 0.05, 0.15, None):  # the last one times out, and is not remembered
        learner.begin_rollout(rng)
        learner.act(HANGING, 0.0)
        sampled.append(learner._explorer.drawn)
        learner.end_rollout("timeout" if miss_m is None else "missed", HANGING, miss_m)
    assert [kept for _, kept in learner._lucky] == [sampled[1], sampled[2]]
    assert (
        SarsaLearner.from_state(
            settings,
            json.loads(
                json.dumps(
                    {
                        key: value.tolist() if isinstance(value, np.ndarray) else value
                        for key, value in learner.state().items()
                    }
                )
            ),
        )._lucky
        == learner._lucky
    )
    for near in sampled[1:]:  # each varies one before it
        assert min(abs(near.frequency_rad_s / other.frequency_rad_s - 1.0) for other in sampled if other != near) < 0.2


def test_scales_of_spread_the_wrong_way_round_are_refused():
    with pytest.raises(ConfigError, match=r"'learn.exploration.spread_scales' is \[4.0, 0.5\]; allowed: \[low, high\]"):
        learn_settings("hard", exploration__spread_scales=[4.0, 0.5])


def walker(n: int = 5, start: float = 0.5, *, trace_decay: float = 0.0, update: UpdateName = "sarsa") -> ValueTable:
    return ValueTable(np.full((n, 1), start), gamma=1.0, trace_decay=trace_decay, update=update)


@pytest.mark.parametrize("update", ["sarsa", "q"])
def test_the_random_walk_converges_to_its_exact_values(update):
    # with one action either update is TD(lambda); root mean square error over 10 seeds was at most 0.036
    table = walker(trace_decay=0.9, update=update)
    errors = Walk().learned(table, np.random.default_rng(1), episodes=2500, alpha=0.2, decay=30.0)
    assert errors[-1] < 0.05


def test_one_step_errors_on_the_random_walk_are_those_of_the_textbook():
    # example 6.2, right figure: TD(0), alpha 0.1, after 100 episodes, mean of 100 runs: 0.05 .. 0.06
    errors = [Walk().learned(walker(), np.random.default_rng(seed), episodes=100, alpha=0.1)[-1] for seed in range(100)]
    assert 0.045 < np.mean(errors) < 0.07


def test_middle_lambdas_learn_the_walk_of_19_positions_fastest():
    # figure 12.6: mean error over the first 10 episodes about 0.25 .. 0.3 at lambda 0.8, alpha 0.4, and larger for
    # lambda 0; over 50 seeds we measured 0.266 and 0.414
    def error(trace_decay: float) -> float:
        means = []
        for seed in range(20):
            table = walker(19, 0.0, trace_decay=trace_decay)
            walk = Walk(19, left=-1.0)
            means.append(np.mean(walk.learned(table, np.random.default_rng(seed), episodes=10, alpha=0.4)))
        return float(np.mean(means))

    assert 0.24 < error(0.8) < 0.31
    assert error(0.0) > 0.38


def test_with_lambda_one_untouched_values_become_the_discounted_return():
    gamma = 0.9
    table = ValueTable(np.zeros((3, 1)), gamma=gamma, trace_decay=1.0)
    table.begin()
    for row, after in ((0, 1), (1, 2), (2, None)):
        table.update(Transition(row, 0, 1.0, after, None if after is None else 0), 1.0)
    # offline lambda = 1 is Monte Carlo; with alpha 1 and untouched tables it is so online as well
    np.testing.assert_allclose(table.q[:, 0], [1 + gamma + gamma**2, 1 + gamma, 1.0], atol=1e-15)


def test_a_new_rollout_owes_nothing_to_the_last():
    table = ValueTable(np.zeros((2, 1)), gamma=1.0, trace_decay=1.0)
    table.begin()
    table.update(Transition(0, 0, 0.0, None, None), 0.5)
    table.begin()
    table.update(Transition(1, 0, 1.0, None, None), 0.5)
    np.testing.assert_array_equal(table.q[:, 0], [0.0, 0.5])


def fractions(visits: list[int], alpha: float = 0.1, fading: float = 0.8) -> list[float]:
    """Gain of each of three states, per alpha, from an error of 1 at the last of ``visits``."""
    table = ValueTable(np.zeros((3, 1)), gamma=1.0, trace_decay=fading)
    for row in visits[:-1]:
        table.update(Transition(row, 0, 0.0, row, 0), alpha)  # value 0 stays 0: traces alone
    table.update(Transition(visits[-1], 0, 1.0, None, None), alpha)
    return (table.q[:, 0] / alpha).tolist()


def test_a_trace_fades_by_gamma_lambda_with_every_visit_elsewhere_and_a_second_visit_replaces_it():
    assert fractions([0, 1, 2]) == pytest.approx([0.64, 0.8, 1.0], rel=1e-14)
    assert fractions([0, 0])[0] == pytest.approx(1.0)


def test_a_trace_of_a_state_belongs_to_the_action_chosen_there_last() -> None:
    """Singh and Sutton 1996: a second visit with another action leaves nothing of the first; pairs keep theirs."""
    changed = {}
    for by_state in (False, True):
        table = ValueTable(np.zeros((2, 2)), gamma=1.0, trace_decay=1.0, by_state=by_state)
        table.update(Transition(0, 0, 0.0, 1, 0), 0.5)
        table.update(Transition(1, 0, 0.0, 0, 1), 0.5)
        table.update(Transition(0, 1, 10.0, None, None), 0.5)
        changed[by_state] = table.q.tolist()
    assert changed == {False: [[5.0, 5.0], [5.0, 0.0]], True: [[0.0, 5.0], [5.0, 0.0]]}
