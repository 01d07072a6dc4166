"""Temporal differences and traces against problems whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kendama_cli.learning.temporal_difference import ValueTable
from kendama_cli.learning.traces import TRACES
from kendama_cli.learning.updates import UPDATES, Transition
from tests.learning.textbook import Walk


def walker(n: int = 5, start: float = 0.5, *, trace_decay: float = 0.0, **named: str) -> ValueTable:
    return ValueTable(np.full((n, 1), start), gamma=1.0, trace_decay=trace_decay, **named)


LAWS = [("replacing", 0.9), ("accumulating", 0.5), ("dutch", 0.9)]
OFFERED = [(update, *law) for update in UPDATES for law in LAWS if (update, law[0]) != ("double_sarsa", "dutch")]


@pytest.mark.parametrize(("update", "traces", "trace_decay"), OFFERED)
def test_the_random_walk_converges_to_its_exact_values(update, traces, trace_decay):
    # with one action all updates are TD(lambda); root mean square error over 10 seeds was at most 0.036
    table = walker(trace_decay=trace_decay, traces=traces, update=update)
    errors = Walk().learned(table, np.random.default_rng(1), episodes=2500, alpha=0.2, decay=30.0)
    assert errors[-1] < 0.05


def test_one_step_errors_on_the_random_walk_are_those_of_the_textbook():
    # example 6.2, right figure: TD(0), alpha 0.1, after 100 episodes, mean of 100 runs: 0.05 .. 0.06
    errors = [Walk().learned(walker(), np.random.default_rng(seed), episodes=100, alpha=0.1)[-1] for seed in range(100)]
    assert 0.045 < np.mean(errors) < 0.07


@pytest.mark.parametrize("traces", TRACES)
def test_middle_lambdas_learn_the_walk_of_19_places_fastest(traces):
    # figures 12.3, 12.6 and 12.8: mean error over the first 10 episodes about 0.25 .. 0.3 at lambda 0.8, alpha 0.4, and
    # larger for lambda 0; over 50 seeds we measured 0.266 / 0.284 / 0.263 (replacing, accumulating, dutch) and 0.414
    def error(trace_decay: float) -> float:
        means = []
        for seed in range(20):
            table = walker(19, 0.0, trace_decay=trace_decay, traces=traces)
            walk = Walk(19, left=-1.0)
            means.append(np.mean(walk.learned(table, np.random.default_rng(seed), episodes=10, alpha=0.4)))
        return float(np.mean(means))

    assert 0.24 < error(0.8) < 0.31
    assert error(0.0) > 0.38


def online_lambda_return(start: np.ndarray, steps: list[Transition], gamma: float, lam: float, alpha: float) -> list:
    """The values after each step by the definition of section 12.4: all updates made anew at every new horizon."""
    diagonal = [start.copy()]
    for h in range(1, len(steps) + 1):

        def bootstrapped(t: int, end: int) -> float:
            total = sum(gamma ** (k - t) * steps[k].reward for k in range(t, end))
            after = steps[end - 1].next_row
            return total + (0.0 if after is None else gamma ** (end - t) * diagonal[end - 1][after])

        values = start.copy()
        for t in range(h):
            returns = [bootstrapped(t, t + n) for n in range(1, h - t + 1)]
            mixed = (
                sum((1 - lam) * lam**n * value for n, value in enumerate(returns[:-1]))
                + lam ** (h - t - 1) * (returns[-1])
            )
            values[steps[t].row] += alpha * (mixed - values[steps[t].row])
        diagonal.append(values)
    return diagonal[1:]


@given(st.integers(0, 10_000), st.floats(0.5, 1.0), st.floats(0.0, 1.0), st.floats(0.05, 0.9))
def test_dutch_traces_are_the_online_lambda_return_exactly(seed, gamma, lam, alpha):
    steps = Walk(5, left=-1.0).episode(np.random.default_rng(seed))[:25]
    start = np.linspace(-0.3, 0.8, 5)
    table = ValueTable(start[:, None], gamma=gamma, trace_decay=lam, traces="dutch")
    table.begin()
    for step, wanted in zip(steps, online_lambda_return(start, steps, gamma, lam, alpha), strict=True):
        table.update(step, alpha)
        np.testing.assert_allclose(table.q[:, 0], wanted, atol=1e-12)


@pytest.mark.parametrize("traces", ["replacing", "accumulating"])
def test_other_traces_are_so_only_nearly(traces):
    steps = Walk(5, left=-1.0).episode(np.random.default_rng(3))
    start = np.zeros(5)
    table = ValueTable(start[:, None], gamma=1.0, trace_decay=0.8, traces=traces)
    for step in steps:
        table.update(step, 0.4)
    assert np.abs(table.q[:, 0] - online_lambda_return(start, steps, 1.0, 0.8, 0.4)[-1]).max() > 1e-3


@pytest.mark.parametrize("traces", TRACES)
def test_with_lambda_one_untouched_values_become_the_discounted_return(traces):
    gamma = 0.9
    table = ValueTable(np.zeros((3, 1)), gamma=gamma, trace_decay=1.0, traces=traces)
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


def shares(traces: str, visits: list[int], alpha: float = 0.1, fading: float = 0.8) -> list[float]:
    """What each of three states gains, per alpha, from an error of 1 at the last of ``visits``."""
    table = ValueTable(np.zeros((3, 1)), gamma=1.0, trace_decay=fading, traces=traces)
    for row in visits[:-1]:
        table.update(Transition(row, 0, 0.0, row, 0), alpha)  # value 0 stays 0: traces alone
    table.update(Transition(visits[-1], 0, 1.0, None, None), alpha)
    return (table.q[:, 0] / alpha).tolist()


def test_a_trace_fades_by_gamma_lambda_with_every_visit_elsewhere():
    for traces in TRACES:
        assert shares(traces, [0, 1, 2]) == pytest.approx([0.64, 0.8, 1.0], rel=1e-14)


def test_a_second_visit_replaces_adds_or_adds_less():
    assert shares("replacing", [0, 0])[0] == pytest.approx(1.0)
    assert shares("accumulating", [0, 0])[0] == pytest.approx(1.8)
    assert shares("dutch", [0, 0], alpha=0.3)[0] == pytest.approx(0.7 * 0.8 + 1.0)
