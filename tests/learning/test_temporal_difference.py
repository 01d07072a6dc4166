"""SARSA(lambda) against problems whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.learning.temporal_difference import SarsaTable, Transition
from kendama_cli.learning.traces import visited

STATES = 5
TRUE_VALUE = np.arange(1, STATES + 1) / (STATES + 1)
"""Random walk on a line, absorbed left with 0 and right with 1 (Sutton and Barto, example 6.2)."""


def random_walk(
    rng: np.random.Generator, *, episodes: int, trace_decay: float, traces: str, alpha: float, decay: float = np.inf
) -> np.ndarray:
    """Values learned from ``episodes`` walks from the middle."""
    table = SarsaTable(np.full((STATES, 1), 0.5), gamma=1.0, trace_decay=trace_decay, traces=traces)
    for episode in range(episodes):
        table.begin()
        place = STATES // 2
        while 0 <= place < STATES:
            after = place + (1 if rng.random() < 0.5 else -1)
            inside = 0 <= after < STATES
            step = Transition(place, 0, float(after == STATES), after if inside else None, 0 if inside else None)
            table.update(step, alpha / (1.0 + episode / decay))
            place = after
    return table.q[:, 0]


@pytest.mark.parametrize("traces", ["replacing", "accumulating", "dutch"])
@pytest.mark.parametrize("trace_decay", [0.0, 0.5, 0.9])
def test_the_random_walk_converges_to_its_exact_values(traces, trace_decay):
    # root mean square error over 10 seeds was at most 0.036 (accumulating, 0.9)
    learned = random_walk(
        np.random.default_rng(1), episodes=3000, trace_decay=trace_decay, traces=traces, alpha=0.2, decay=30.0
    )
    assert np.sqrt(np.mean((learned - TRUE_VALUE) ** 2)) < 0.05


def test_one_step_errors_on_the_random_walk_are_those_of_the_textbook():
    # Sutton and Barto, example 6.2, right figure: TD(0), alpha 0.1, 100 episodes, mean of 100 runs: 0.05 .. 0.06
    errors = [
        np.sqrt(
            np.mean(
                (
                    random_walk(
                        np.random.default_rng(seed), episodes=100, trace_decay=0.0, traces="replacing", alpha=0.1
                    )
                    - TRUE_VALUE
                )
                ** 2
            )
        )
        for seed in range(100)
    ]
    assert 0.045 < np.mean(errors) < 0.07


def test_with_lambda_one_replacing_traces_learn_the_discounted_return_of_a_first_visit():
    gamma = 0.9
    table = SarsaTable(np.zeros((3, 1)), gamma=gamma, trace_decay=1.0, traces="replacing")
    table.begin()
    for row, after in ((0, 1), (1, 2), (2, None)):
        table.update(Transition(row, 0, 1.0, after, None if after is None else 0), 1.0)
    # offline lambda = 1 is Monte Carlo; with alpha 1 and untouched tables it is so online as well
    np.testing.assert_allclose(table.q[:, 0], [1 + gamma + gamma**2, 1 + gamma, 1.0], atol=1e-15)


def test_a_new_rollout_owes_nothing_to_the_last():
    table = SarsaTable(np.zeros((2, 1)), gamma=1.0, trace_decay=1.0, traces="replacing")
    table.begin()
    table.update(Transition(0, 0, 0.0, None, None), 0.5)
    table.begin()
    table.update(Transition(1, 0, 1.0, None, None), 0.5)
    np.testing.assert_array_equal(table.q[:, 0], [0.0, 0.5])


def test_sarsa_finds_the_shortest_way_through_a_windy_gridworld():
    # Sutton and Barto, example 6.5: 7 x 10 cells, wind 0 0 0 1 1 1 2 2 1 0, four moves; the shortest way has 15 steps
    wind = (0, 0, 0, 1, 1, 1, 2, 2, 1, 0)
    moves = ((-1, 0), (1, 0), (0, -1), (0, 1))
    rng = np.random.default_rng(3)

    def move(place: tuple[int, int], action: int) -> tuple[int, int]:
        row, column = place
        up, right = moves[action]
        return min(6, max(0, row + up - wind[column])), min(9, max(0, column + right))

    def choose(q: np.ndarray, place: tuple[int, int], epsilon: float) -> int:
        if rng.random() < epsilon:
            return int(rng.integers(4))
        return int(np.argmax(q[place[0] * 10 + place[1]]))

    def walk(table: SarsaTable, epsilon: float, alpha: float) -> int:
        table.begin()
        place, steps = (3, 0), 0
        action = choose(table.q, place, epsilon)
        while place != (3, 7) and steps < 2000:
            after = move(place, action)
            following = choose(table.q, after, epsilon)
            done = after == (3, 7)
            table.update(
                Transition(
                    place[0] * 10 + place[1],
                    action,
                    -1.0,
                    None if done else after[0] * 10 + after[1],
                    None if done else following,
                ),
                alpha,
            )
            place, action, steps = after, following, steps + 1
        return steps

    table = SarsaTable(np.zeros((70, 4)), gamma=1.0, trace_decay=0.8, traces="replacing")
    for episode in range(400):
        walk(table, 0.1 / (1 + episode / 50), 0.3)
    assert walk(table, 0.0, 0.0) <= 17


def test_replacing_traces_never_exceed_one_and_accumulating_ones_do():
    rng = np.random.default_rng(0)
    replacing, accumulating = np.zeros((3, 2)), np.zeros((3, 2))
    for _ in range(50):
        row, column = int(rng.integers(3)), int(rng.integers(2))
        replacing = visited(replacing, row, column, law="replacing", fading=0.9, alpha=0.1)
        accumulating = visited(accumulating, row, column, law="accumulating", fading=0.9, alpha=0.1)
        assert replacing[row, column] == 1.0
        assert replacing.max() <= 1.0
    assert accumulating.max() > 1.0
    assert (accumulating >= replacing).all()


def test_a_trace_fades_by_gamma_lambda_with_every_visit_elsewhere():
    traces = visited(np.zeros((2, 1)), 0, 0, law="replacing", fading=0.8, alpha=0.1)
    for k in range(1, 5):
        traces = visited(traces, 1, 0, law="replacing", fading=0.8, alpha=0.1)
        assert traces[0, 0] == pytest.approx(0.8**k, rel=1e-15)


def test_dutch_traces_lie_between_replacing_and_accumulating():
    start = np.array([[0.6]])
    marks = {law: visited(start, 0, 0, law=law, fading=0.9, alpha=0.3)[0, 0] for law in ("replacing", "dutch")}
    assert marks["replacing"] == 1.0
    assert marks["dutch"] == pytest.approx(0.7 * 0.54 + 1.0)
    full = visited(start, 0, 0, law="dutch", fading=0.9, alpha=1.0)
    assert full[0, 0] == pytest.approx(1.0)


def test_marking_a_visit_leaves_the_old_traces_alone():
    before = np.ones((2, 2))
    visited(before, 0, 0, law="accumulating", fading=0.5, alpha=0.1)
    assert (before == 1.0).all()
