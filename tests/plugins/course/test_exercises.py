"""Every exercise: its solution passes, the empty notebook fails, and a wrong answer fails with a line that helps."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from kendama_cli.plugins.course.checks import exercise_3
from kendama_cli.plugins.course.grading import checks_of, run_cells
from kendama_cli.plugins.course.work import Work, WrongAnswerError
from tests.plugins.course.work_of_students import EXERCISES, QUICK, graded, quick_cells, run, solved_cells

WRONG = {
    (1, 1): ("def velocity(t_s, y):\n    return np.gradient(y, axis=0)", "over their distance in time"),
    (1, 2): ("def moving(t_s, position_m, threshold_m_s=0.05):\n    return t_s[0], t_s[-1]", "first and the last time"),
    (1, 3): ("def acceleration_noise(sigma_m, step_s):\n    return 2 * sigma_m / step_s**2", "factors 1, -2 and 1"),
    (1, 4): ("def ball_angle(t_s, cup_m_s2, rope_m=0.4):\n    return 0 * t_s", "mind the signs"),
    (1, 5): ("highest_m, caught_share = 0.9, 1.0", "its maximum over all swings"),
    (2, 1): ("def features(s):\n    return np.ones((len(s), 20)) / 20", "each row sums to x"),
    (2, 2): ("def force(t_s, y_m):\n    return np.gradient(np.gradient(y_m, t_s), t_s)", "D y' - K (g - y)"),
    (2, 3): ("def fit(t_s, y_m):\n    return np.zeros(20)", "is possible: solve"),
    (2, 4): (
        "def play(w, start_m, goal_m, tau_s, t_s):\n    return np.interp(t_s / tau_s, [0, 1], [start_m, goal_m])",
        "mm rms off",
    ),
    (2, 5): ("mean_w = fit(*trimmed(swings[0]))\nmean_goal_m = mean_duration_s = 0.0", "take the mean over the swings"),
    (3, 1): ("def miss_m(tau):\n    return 1000 * (tau - 1)", "carry the cup"),
    (3, 2): (
        "def windows(taus, misses, half_width_m):\n    good = taus[np.abs(misses) <= half_width_m]\n"
        "    return [(good[0], good[-1])] if len(good) else []",
        "window",
    ),
    (3, 3): (
        "def search(miss, first, second, enough_m):\n    calls = 1\n    while abs(miss(first)) > enough_m:\n"
        "        first, calls = first + 0.01, calls + 1\n    return first, calls",
        "search()",
    ),
    (3, 4): ("robust_tau, success_share = 0.95, 0.0", "look in the other window"),
    (3, 5): ("def wilson(k, n):\n    return k / n, k / n", "z = 1.96"),
    (4, 1): ("def row(observation):\n    return 0", "the digits are"),
    (4, 2): (
        "def update(Q, e, s, a, r, s2, a2, alpha, gamma, lam):\n    e[s, a] += 1\n"
        "    delta = r - Q[s, a] + (0 if s2 is None else gamma * Q[s2, a2])\n    Q += alpha * delta * e\n"
        "    e *= gamma * lam\n    return delta",
        "is 1 (not one more)",
    ),
    (4, 3): ("def harmonic(rng):\n    return lambda t_s: 8 * np.sin(5 * t_s)", "draw it for each harmonic"),
    (4, 4): ("def greedy(values, before):\n    return int(np.argmax(values))", "expected 3"),
    (4, 5): ("def lucky(seed):\n    return 5", "the first of ten"),
    (4, 6): (
        "table_rollouts, null_rollouts = [50, 60, 55, 52, 58], [800, 900, 700, 850, 790]\n"
        "interval, verdict = (-800.0, -700.0), 'null'",
        "",
    ),
    (5, 1): ("shares = dict.fromkeys(BODIES, 1.0)\nharmless = '60 ms late'", "the mean of rollout"),
    (5, 2): ("def to_model(observation, k):\n    return tuple(observation)", "go back by dividing"),
    (5, 3): ("def ahead(state, coming, step_s):\n    return state", "held for step_s"),
    (5, 4): ("believed, tolerance_ms = [1.0] * 5, 40", "believed[0]"),
    (6, 1): ("def project(camera, point_m):\n    return camera.center_px", "R (p - o)"),
    (6, 2): ("def triangulate(cameras, pixels):\n    return np.zeros(3)", "solve by lstsq"),
    (6, 3): ("def fit_flight(t_s, places_m):\n    return places_m[0], np.zeros(3)", "fit a line"),
    (6, 4): ("def crossing(p0, v0, height_m):\n    return 0.0, p0[0], p0[1]", "the later one"),
    (6, 5): ("def bound(t_s, sigma_m, p0, v0, height_m):\n    return sigma_m, sigma_m", "(A^T A)^-1"),
    (6, 6): ("ratio_t, ratio_x = 1.0, 1.0", "exactly 1"),
    (7, 1): ("def landing(seen):\n    return 0.3, 0.0", "own times"),
    (7, 2): ("def meet(x_m, velocity_m_s, target_m, left_s):\n    return 2 * (target_m - x_m)", "brings it there"),
    (7, 3): ("def act(seen, t_s, x_m, velocity_m_s):\n    return 0.0", "a cup that stands still"),
    (7, 4): ("hasty = act\npatient_shares = hasty_shares = [0.0] * 5", "patient_shares[0]"),
    (7, 5): ("naive = act\nhonest_shares = naive_shares = [0.0] * 6", "honest_shares[0]"),
    (7, 6): ("broken = dict.fromkeys(WAYS, 0.5)\nweakest = '80 ms late'", "share(act, **WAYS[name])"),
    (7, 7): ("def known_since(games, estimates, index, within_m):\n    return 0.2", "after the last one that is off"),
}
"""For each task an answer that a student might give, and what the line says to it."""


@pytest.fixture(scope="module", autouse=True)
def laptop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """An empty folder with a store of its own, as a student's."""
    folder = tmp_path_factory.mktemp("student")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("MPLBACKEND", "Agg")
        yield folder


@pytest.fixture(scope="module")
def worked(laptop: Path) -> dict[int, dict[str, Any]]:
    """The names of each solved notebook, as far as its cells take seconds; made once."""
    return {}


def names_of(number: int, worked: dict[int, dict[str, Any]]) -> dict[str, Any]:
    if number not in worked:
        worked[number] = run(quick_cells(solved_cells(EXERCISES[number]), QUICK[number]))
    return worked[number]


def test_there_are_eight_exercises_of_half_an_hour_to_an_hour_with_a_check_and_a_wrong_answer_for_each_task() -> None:
    assert sorted(EXERCISES) == [1, 2, 3, 4, 5, 6, 7, 8]
    for number, exercise in EXERCISES.items():
        assert 30 <= exercise.minutes <= 60
        assert list(exercise.tasks) == list(checks_of(number)) == list(range(1, len(exercise.tasks) + 1))
        asked = [cell.task for cell in exercise.cells if cell.task is not None]
        assert asked == ([] if number == 8 else list(exercise.tasks)), "the tasks of 8 are files"
        assert number == 8 or {task for n, task in WRONG if n == number} == set(exercise.tasks)


@pytest.mark.parametrize("number", QUICK)
def test_the_solution_passes(number: int, worked: dict[int, dict[str, Any]], laptop: Path) -> None:
    work = Work(names_of(number, worked), laptop)
    for task in QUICK[number]:
        checks_of(number)[task](work)


@pytest.mark.parametrize("number", QUICK)
def test_every_task_of_the_empty_notebook_fails_with_a_line(number: int, laptop: Path) -> None:
    cells = quick_cells(EXERCISES[number].cells, tuple(EXERCISES[number].tasks))
    names, _ = run_cells(cells)
    for grade in graded(number, names, laptop).values():
        assert not grade.solved
        assert grade.line, f"task {grade.task}"


@pytest.mark.parametrize(("number", "task"), WRONG, ids=[f"{number}.{task}" for number, task in WRONG])
def test_a_wrong_answer_fails_with_a_line_that_helps(
    number: int, task: int, worked: dict[int, dict[str, Any]], laptop: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exercise_3, "SEEDS", 3)
    monkeypatch.setattr(exercise_3, "TRIES", 3)
    names, (code, wanted) = names_of(number, worked), WRONG[number, task]
    before = dict(names)
    try:
        exec(code, names)
        with pytest.raises(WrongAnswerError) as raised:
            checks_of(number)[task](Work(names, laptop))
        assert wanted in " ".join(str(raised.value).split())
    finally:
        names.clear()
        names.update(before)


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("number", QUICK)
def test_the_whole_solved_notebook_runs_and_every_task_passes(number: int, laptop: Path) -> None:
    names = run([cell for cell in solved_cells(EXERCISES[number]) if cell.code])
    assert [grade.line for grade in graded(number, names, laptop).values()] == [""] * len(EXERCISES[number].tasks)
