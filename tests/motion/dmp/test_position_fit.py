"""Least squares on the positions: the figures that it must reach, on swings that it was not tuned to."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.dmp import position_fit
from kendama_cli.motion.dmp.averaging import Encoding, encode, encode_demonstrations, prepare
from kendama_cli.motion.dmp.basis import Basis
from kendama_cli.motion.dmp.position_fit import PRICES, Ends, even_operator, operator, project, solve_positions
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.motion.dmp.response_columns import read_rows, response_columns
from tests.motion.swings import demonstration, path, settings, smooth_step


def random_swing(rng: np.random.Generator, seconds: float = 2.5, rate_hz: float = 100.0) -> np.ndarray:
    """To-and-fro motions of about 0.3 m and 1 m/s that rest at both ends (n, 3)."""
    t = np.arange(round(seconds * rate_hz) + 1) / rate_hz
    u = t / t[-1]
    position = np.zeros((len(t), 3))
    for axis, size in enumerate((0.2, 0.02, 0.15)):
        for _ in range(4):
            start = rng.uniform(0.05, 0.55)
            length = rng.uniform(0.25, 0.95 - start)
            position[:, axis] += size * rng.normal() * smooth_step((u - start) / length)
    return position


def as_demonstration(place: np.ndarray, rate_hz: float = 100.0) -> Demonstration:
    return Demonstration("swing", np.arange(len(place)) / rate_hz, place)


def encoded(place: np.ndarray, rate_hz: float = 100.0, **changes: object) -> Encoding:
    chosen = settings(**changes)
    return encode(prepare([as_demonstration(place, rate_hz)], chosen), chosen)


def error_mm(place: np.ndarray, clean: np.ndarray | None = None, **changes: object) -> tuple[float, float]:
    """Rms and largest distance of the primitive from the clean samples, place for place."""
    made = encoded(place, trim="none", **changes)
    plan = made.plan(0)
    reproduced = play(plan, made.trimmed[0].share * plan.duration_s).position_m + made.parameters.origin_m[0] + place[0]
    distance = 1e3 * np.linalg.norm(reproduced - (place if clean is None else clean), axis=1)
    found = float(np.sqrt(np.mean(distance**2))), float(distance.max())
    own = made.deviation(plan, 0)
    assert clean is not None or (1e3 * own.rms_m, 1e3 * own.max_m, own.samples) == pytest.approx((*found, len(place)))
    return found


def test_swings_of_20_functions_are_reproduced_to_a_quarter_of_a_millimetre() -> None:
    """The median of 20 random swings; the spread is the swings' own: a short jerk needs more than 20 functions."""
    rng = np.random.default_rng(100)
    errors = np.array([error_mm(random_swing(rng)) for _ in range(20)])
    assert np.median(errors[:, 0]) < 0.25
    assert np.median(errors[:, 1]) < 0.65


def test_a_swing_cut_at_both_ends_is_reproduced_to_less_than_a_tenth_of_a_millimetre() -> None:
    rng = np.random.default_rng(101)
    errors = np.array([error_mm(random_swing(rng)[70:190]) for _ in range(20)])
    assert np.median(errors[:, 0]) < 0.06
    assert np.median(errors[:, 1]) < 0.3


def test_half_a_millimetre_of_noise_costs_less_than_half_a_millimetre() -> None:
    """White noise in three coordinates is 0.87 mm; against the clean motion less than 0.5 mm of it is left."""
    rng = np.random.default_rng(102)
    whole, crop = [], []
    for _ in range(12):
        clean = random_swing(rng)
        noisy = clean + rng.normal(0, 5e-4, clean.shape)
        whole.append(error_mm(noisy, clean)[0])
        crop.append(error_mm(noisy[70:190], clean[70:190])[0])
    assert np.median(whole) < 0.5
    assert np.median(crop) < 0.5


def test_noise_is_smoothed_more_the_more_there_is() -> None:
    """Cross-validation raises the price of jerk with the noise: less noise is left than plain least squares leaves."""
    rng = np.random.default_rng(103)
    clean = path(np.arange(0.5, 1.7, 0.01))
    basis = Basis(20, 1000.0, 1.0, 1.0)
    made = operator(np.linspace(0, 1, len(clean)), (basis,), Ends(True, True))
    functions = made.see(np.eye(len(clean)))[0]
    plain, chosen = [], []
    for _ in range(20):
        noisy = clean + rng.normal(0, 2e-3, clean.shape)
        score = project(made, noisy.T[None]).score[0, :, 0]
        best = int(score.argmin())
        for price, errors in ((0, plain), (best, chosen)):
            z = made.shrink[0, price][:, None] * (made.turn[0] @ made.see(noisy.T)[0].T)
            errors.append(np.sqrt(np.mean((functions @ (made.turn[0].T @ z) - clean) ** 2)))
    assert np.median(chosen) < 0.85 * np.median(plain)


@pytest.mark.parametrize("ends", [Ends(False, False), Ends(True, False), Ends(False, True), Ends(True, True)])
def test_the_fit_plays_what_it_says_and_meets_its_goal(ends: Ends) -> None:
    """The operator's own motion, the parameters played as a primitive, and the goal at the end are one."""
    rng = np.random.default_rng(104)
    position = random_swing(rng)[60:200]
    made = encoded(position, trim="none")
    plan = made.plan(0)
    basis = made.basis
    fraction = np.linspace(0, 1, len(position))
    rows = solve_positions(operator(fraction, (basis,), ends), (position - position[0]).T[None])[0].T
    assert (rows[1] == 0).all() != ends.start_moves
    assert (rows[3] == 0).all() != ends.end_moves
    end = play(plan, np.array([plan.duration_s]))
    assert np.abs(end.position_m[0] - plan.goal_m).max() < 1e-5
    assert np.abs(end.velocity_m_s[0] - plan.goal_velocity_m_s).max() < 5e-3


def test_the_width_is_the_candidate_that_fits_best() -> None:
    rng = np.random.default_rng(105)
    for _ in range(4):
        position = random_swing(rng)
        widths = settings().width
        alone = [error_mm(position, width=(width,))[0] for width in widths]
        # chosen on every second sample and by a score with the degrees of freedom in it: near the best, not always it
        assert error_mm(position)[0] < 1.1 * min(alone) + 1e-3


def test_uneven_sampling_gives_the_same_primitive() -> None:
    t = np.linspace(0, 2.0, 201)
    jittered = t + np.random.default_rng(2).uniform(-3e-3, 3e-3, t.shape) * np.sin(np.pi * t / 2)
    chosen = settings(trim="none")
    even = encode_demonstrations([demonstration()], chosen)
    uneven = encode_demonstrations([Demonstration("jitter", jittered, path(jittered))], chosen)
    fraction = np.linspace(0, 2.0, 100)
    assert np.abs(play(even, fraction).position_m - play(uneven, fraction).position_m).max() < 2e-4


def test_a_gap_is_bridged_by_the_motion_not_by_a_straight_line() -> None:
    t = np.delete(np.arange(201) / 100, np.arange(90, 97))
    made = encode_demonstrations([Demonstration("gap", t, path(t))], settings(trim="none"))
    missing = np.arange(90, 97) / 100
    truth = path(missing) - path(np.zeros(1))
    line = np.column_stack([np.interp(missing, t, column) for column in (path(t) - path(t)[0]).T])
    assert np.abs(play(made, missing).position_m - truth).max() < min(1e-3, np.abs(line - truth).max())


def test_a_gap_that_hides_the_motion_is_refused_with_its_sample() -> None:
    t = np.delete(np.arange(201) / 100, np.arange(90, 120))
    says = r"demonstration 'gap': after sample 90 nothing is known for 0\.31 s of a motion of 2 s; allowed: 10% of it"
    with pytest.raises(ValueError, match=says):
        prepare([Demonstration("gap", t, path(t))], settings(trim="none"))


@pytest.mark.parametrize("count", [16, 24, 40])
def test_few_samples_are_not_overfitted(count: int) -> None:
    """Fewer samples than parameters: between them the motion stays what it was."""
    t = np.linspace(0.4, 1.6, count)
    plan = encode_demonstrations([Demonstration("few", t, path(t))], settings(trim="none"))
    between = np.linspace(0, 1.2, 400)
    truth = path(between + 0.4) - path(np.array([0.4]))
    # a swing of 0.25 m; measured 0.9, 0.13 and 0.05 mm
    assert np.abs(play(plan, between).position_m - truth).max() < 2e-3


def test_demonstrations_of_one_length_are_solved_as_they_are_alone() -> None:
    rng = np.random.default_rng(106)
    chosen = settings(width=(1.0,), trim="none")
    made = [as_demonstration(random_swing(rng)) for _ in range(3)]
    together = encode(prepare(made, chosen), chosen)
    for i, one in enumerate(made):
        alone = encode(prepare([one], chosen), chosen).plan(0)
        assert np.abs(together.plan(i).weights - alone.weights).max() < 1e-6 * np.abs(alone.weights).max()


@pytest.mark.recording
def test_the_recorded_swing_is_reproduced_to_a_fraction_of_a_millimetre(recordings) -> None:  # type: ignore[no-untyped-def]
    rows = np.loadtxt(recordings / "li-kendama" / "kendama1-20.txt")[:350]
    position = np.column_stack((-rows[:, 1], 0 * rows[:, 1], rows[:, 3])) / 1e3
    rms, maximum = error_mm(position)
    assert rms < 0.25
    assert maximum < 0.65
    for start, end in ((60, 180), (80, 200), (120, 260)):
        rms, maximum = error_mm(position[start:end])
        assert rms < 0.06
        assert maximum < 0.3


@pytest.mark.parametrize("width", [0.7, 1.0, 1.35])
def test_common_functions_solve_what_the_columns_do(width: float) -> None:
    """The normal equations of the orthonormal functions against Q and R of the columns, here in full precision."""
    basis, ends, fraction = Basis(20, 1000.0, 1.0, width), Ends(True, True), np.linspace(0, 1, 1301)
    made = operator(fraction, (basis,), ends)
    seen, rotation, lift, shrink = position_fit._by_columns(fraction, basis, ends)
    position = path(2.0 * fraction).T - path(np.zeros(1)).T
    for price in (0, 5, 10, 20):
        ours = made.lift[0] @ (made.shrink[0, price][:, None] * (made.turn[0] @ made.see(position)[0].T))
        theirs = lift @ (shrink[price][:, None] * (rotation @ (seen.T @ position.T)))
        # metres; what the nodes' interpolation leaves of a swing of 0.25 m, largest where nothing is smoothed
        assert np.abs(ours[[0, 2]] - theirs[[0, 2]]).max() < 1e-9
        assert np.abs(made.shrink[0, price].sum() - shrink[price].sum()) < 1e-7


@pytest.mark.parametrize(("samples", "functions"), [(60, 8), (30, 8), (25, 14)])
@pytest.mark.parametrize("ends", [Ends(False, True), Ends(True, False)])
def test_every_price_of_jerk_has_the_fit_the_freedom_and_the_score_of_ridge_regression(
    samples: int, functions: int, ends: Ends
) -> None:
    """Score by numpy, with the miss of the goal as two more samples: n RSS / (n - trace of the hat matrix)^2."""
    basis, rng = Basis(functions, 225.0, 1.0, 1.0), np.random.default_rng(10024)
    share = np.sort(np.append(rng.uniform(0, 1, samples - 2), [0.0, 1.0]))
    swings = path(2.0 * share)[:, :2].T * rng.uniform(0.5, 1.5, (3, 2, 1)) + rng.normal(0, 2e-3, (3, 2, samples))
    made, columns, n = operator(share, (basis,), ends), response_columns([basis]), samples
    free = [*ends.columns, *range(4, 4 + functions)]
    seen = read_rows(columns.rows, share)[0][:, free]
    jerk, miss = columns.jerk[0][:, free], 10.0 * np.sqrt(n) * columns.miss[0][:, free]
    found, scores, fits = project(made, swings), [], []
    for k, price in enumerate(PRICES):
        rows = np.vstack((seen, miss, np.sqrt(price * n) * jerk))
        inverse = np.linalg.pinv(rows)[:, : n + len(miss)]
        fitted = swings @ inverse[:, :n].T
        freedom = n - float(np.trace(rows[: n + len(miss)] @ inverse))
        enough = freedom > 0.2 * n
        assert made.freedom[0, k] == (pytest.approx(freedom, rel=1e-4) if enough else max(1e-6, made.freedom[0, k]))
        rss = ((swings - fitted @ seen.T) ** 2).sum(axis=(1, 2)) + ((fitted @ miss.T) ** 2).sum(axis=(1, 2))
        scores.append(n * rss / freedom**2 if enough else np.full(3, np.inf))
        fits.append(fitted)
        if enough:
            assert found.score[0, k] == pytest.approx(scores[-1], rel=1e-3)
    # a motion without residual counts as one of a tenth of a micrometre
    still = project(made, 0 * swings).score[0, :, 0] * made.freedom[0] ** 2
    assert still == pytest.approx(n * 2 * n * 1e-14)
    best = np.argmin(scores, axis=0)
    solved = solve_positions(made, swings)
    for one, k in enumerate(best):
        assert solved[one][:, free] @ seen.T == pytest.approx(fits[k][one] @ seen.T, abs=1e-6)
        assert not np.delete(solved[one], free, axis=1).any()


def test_samples_too_few_for_normal_equations_are_factorised_by_columns() -> None:
    basis, ends, fraction = Basis(20, 1000.0, 1.0, 0.8), Ends(False, False), np.linspace(0, 1, 30)
    made = operator(fraction, (basis,), ends)
    assert np.array_equal(made.see(np.eye(30))[0], position_fit._by_columns(fraction, basis, ends)[0])


@pytest.mark.parametrize("ends", [Ends(False, False), Ends(True, True)])
@pytest.mark.parametrize("count", [966, 1301, 5000])
def test_many_even_samples_are_summed_by_cells_and_series_as_one_by_one(count: int, ends: Ends) -> None:
    bases = (Basis(20, 1000.0, 1.0, 0.7), Basis(20, 1000.0, 1.0, 1.35))
    fraction = np.linspace(0, 1, count)
    position = path(2.0 * fraction).T - path(np.zeros(1)).T + np.random.default_rng(108).normal(0, 1e-3, (3, count))
    made, one_by_one = even_operator(count, bases, ends), operator(fraction, bases, ends)
    assert made.see.func is not one_by_one.see.func  # type: ignore[attr-defined]
    # functions of norm 1: what is added up differently differs by rounding
    assert np.abs(made.see(position) - one_by_one.see(position)).max() < 1e-12 * count
    ours, theirs = solve_positions(made, position[None]), solve_positions(one_by_one, position[None])
    # metres, of a swing of 0.25; the series leaves 2e-11 of the products at 966 samples
    assert np.abs(ours[:, :, [0, 2]] - theirs[:, :, [0, 2]]).max() < 1e-11
    assert np.abs(made.freedom - one_by_one.freedom).max() < 1e-8
