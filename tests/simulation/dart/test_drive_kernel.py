from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart import drive_kernel
from kendama_cli.simulation.dart.drive_kernel import Drive, limit_rows

PERIOD = 0.001
LOW, HIGH = np.array([-1.0, -0.5]), np.array([1.5, 0.5])
FASTEST, TOP = np.array([1.0, 2.0]), np.array([10.0, 40.0])
ROUNDING = 1e-9


def drive() -> Drive:
    made = Drive(JointLimits(LOW, HIGH, FASTEST, TOP, np.ones(2)), PERIOD)
    made.reset(np.zeros(2))
    return made


def played(made: Drive, reference: list[tuple[Array, Array, Array]]) -> tuple[Array, Array, Array]:
    a, q, v = zip(*((made.follow(*one), made.position_rad, made.velocity_rad_s) for one in reference), strict=True)
    return np.array(q), np.array(v), np.array(a)


def sine(amplitude: float, rate: float, steps: int) -> list[tuple[Array, Array, Array]]:
    t = PERIOD * np.arange(1, steps + 1)[:, None] * np.ones(2)
    wave = (
        amplitude * (1 - np.cos(rate * t)),
        amplitude * rate * np.sin(rate * t),
        amplitude * rate**2 * np.cos(rate * t),
    )
    return list(zip(*wave, strict=True))


def test_a_reference_within_the_limits_passes_unchanged() -> None:
    reference = sine(0.1, 8.0, 2000)
    q, v, a = played(drive(), reference)
    assert (q == [one[0] for one in reference]).all()
    assert (v == [one[1] for one in reference]).all()
    assert a[2:] == pytest.approx(np.diff(q, 2, axis=0) / PERIOD**2, abs=1e-8)  # places are exact to 1e-16


def test_positions_are_the_integral_of_speeds() -> None:
    q, v, _ = played(drive(), sine(2.0, 20.0, 800))
    step = np.diff(q, axis=0) - PERIOD * (v[1:] + v[:-1]) / 2
    assert np.abs(step).max() <= (TOP * PERIOD**2 / 6).max() * (1 + 1e-6)


def test_a_jump_is_caught_up_with_in_nearly_the_least_possible_time() -> None:
    """A rest-to-rest move of d takes at least 2 sqrt(d/A), or d/V + V/A where the top speed is reached."""
    made, goal = drive(), np.array([0.6, 0.4])
    q, v, _ = played(made, [(goal, np.zeros(2), np.zeros(2))] * 2000)
    assert np.abs(q[-1] - goal).max() < 1e-9
    assert np.abs(v[-1]).max() < 1e-9
    shortest_s = np.where(goal > FASTEST**2 / TOP, goal / FASTEST + FASTEST / TOP, 2 * np.sqrt(goal / TOP))
    arrived = PERIOD * (1 + np.array([np.flatnonzero(np.abs(q[:, j] - goal[j]) > 1e-3)[-1] for j in range(2)]))
    assert (arrived < 1.1 * shortest_s + 0.01).all()
    assert (q <= goal + 1e-6).all()


def test_a_moving_reference_is_caught_up_with_and_followed_exactly() -> None:
    made = drive()
    made.reset(np.array([0.3, -0.3]))
    reference = sine(0.1, 6.0, 3000)
    q, _, _ = played(made, reference)
    assert np.abs(q[1500:] - np.array([one[0] for one in reference])[1500:]).max() < 1e-9
    assert not made.limited


def test_one_joint_that_cannot_follow_does_not_hold_back_the_others() -> None:
    made = drive()
    still, far = np.zeros(2), np.array([9.0, 0.0])
    made.follow(far, still, still)
    assert made.limited
    assert made.position_rad[1] == 0.0
    assert 0 < made.position_rad[0] <= TOP[0] * PERIOD**2


def test_a_stop_is_reached_at_rest_and_kept() -> None:
    q, v, _ = played(drive(), [(np.array([99.0, -99.0]), np.zeros(2), np.zeros(2))] * 4000)
    assert q[-1] == pytest.approx([HIGH[0], LOW[1]], abs=1e-6)
    assert np.abs(v[-1]).max() < 1e-3


LONG, STOP, QUICK, HARD = 0.02, 0.5, 1.0, 10.0
"""Long periods of one joint, its stops, speed and acceleration: a change of speed in a period counts."""
ONE = JointLimits(np.array([-STOP]), np.array([STOP]), np.array([QUICK]), np.array([HARD]), np.ones(1))
ROWS = limit_rows(ONE, LONG)


def _way(speed: float) -> float:
    """v^2 / 2 A + A T^2 / 8, or v T / 2 where v < A T / 2."""
    if speed <= 0.0:
        return 0.0
    return speed**2 / (2 * HARD) + HARD * LONG**2 / 8 if speed > HARD * LONG / 2 else speed * LONG / 2


def _cubic(q0: float, v0: float, q1: float, v1: float) -> tuple[np.polynomial.Polynomial, Array]:
    """The cubic between two states over u from 0 to 1, and where it, its slope and its bend may be extreme."""
    a, b = LONG * v0, LONG * v1
    cubic = np.polynomial.Polynomial([q0, a, 3 * (q1 - q0) - 2 * a - b, 2 * (q0 - q1) + a + b])
    inner = [0.0, 1.0]
    for curve in (cubic.deriv(), cubic.deriv(2)):
        roots = np.asarray(curve.roots(), dtype=complex)
        inner += [root.real for root in roots.tolist() if abs(root.imag) < 1e-12 and 0 < root.real < 1]
    return cubic, np.array(inner)


def _past_stops(q0: float, v0: float, q1: float, v1: float) -> float:
    """Excess over a stop of the cubic, or of the way on which its end brakes; negative between them."""
    cubic, at = _cubic(q0, v0, q1, v1)
    return float(max(np.abs(cubic(at)).max(), q1 + _way(v1), -q1 + _way(-v1)) - STOP)


def _excess(q0: float, v0: float, q1: float, v1: float) -> float:
    """Largest excess of the cubic between two states over each limit, in its own unit; negative within all."""
    cubic, at = _cubic(q0, v0, q1, v1)
    speed, change = cubic.deriv()(at) / LONG, cubic.deriv(2)(at) / LONG**2
    return float(max(_past_stops(q0, v0, q1, v1), np.abs(speed).max() - QUICK, np.abs(change).max() - HARD))


def _states(rng: np.random.Generator) -> tuple[float, float]:
    """Somewhere, often near a stop, with as much speed as leaves room to brake, often all of it."""
    side, part = rng.choice([-1.0, 1.0]), rng.choice([rng.uniform(-1, 1), 1.0])
    q = STOP - rng.choice([rng.uniform(0, 2 * STOP), rng.exponential(0.01)])
    v = min(QUICK, drive_kernel._fastest(0.0, max(STOP - q, 0.0), HARD, LONG)) * part
    return max(q, -STOP) * side, (v if v > 0 or q > 0 else max(v, -0.05)) * side


def test_a_cubic_is_within_the_limits_where_its_extremes_are_and_it_ends_with_room_to_brake() -> None:
    rng, seen = np.random.default_rng(1), []
    for _ in range(1500):
        q0, v0 = _states(rng)
        v1 = np.clip(v0 + HARD * LONG * rng.uniform(-1.1, 1.1), -1.02 * QUICK, 1.02 * QUICK)
        q1 = q0 + LONG * (v0 + v1) / 2 + HARD * LONG**2 / 6 * rng.normal(0, 0.4)
        excess = _excess(q0, v0, q1, v1)
        if abs(excess) > 1e-8:
            seen.append(excess < 0)
            assert drive_kernel._within(q0, v0, q1, v1, ROWS, LONG, 0) == (excess < 0)
    assert 0.2 < np.mean(seen) < 0.8


def test_a_cubic_of_any_bend_keeps_the_stops_where_its_own_extremes_do() -> None:
    rng, seen, inside = np.random.default_rng(5), [], 0
    for _ in range(1500):
        side = rng.choice([-1.0, 1.0])
        q0, q1 = side * (STOP - rng.exponential(0.01, 2))
        v0, v1 = side * rng.normal(0, [2.0, 1.0])
        past = _past_stops(q0, v0, q1, v1)
        if abs(past) > 1e-9:
            seen.append(past < 0)
            inside += past > 0 > max(abs(q0), abs(q1), q1 + _way(v1), -q1 + _way(-v1)) - STOP
            assert drive_kernel._keeps_stops(q0, v0, q1, v1, ROWS, LONG, 0) == (past < 0)
    assert 0.1 < np.mean(seen) < 0.9
    assert inside > 50, "some pass a stop between their ends alone"


def test_the_fastest_speed_after_a_period_uses_all_room_to_brake() -> None:
    rng = np.random.default_rng(2)
    for _ in range(300):
        v0 = rng.uniform(-1, 1)
        room = rng.choice([0.0, 0.005, 0.5]) * rng.uniform(-0.5, 1) + LONG * v0 / 2
        v1 = drive_kernel._fastest(v0, room, HARD, LONG)
        assert LONG * (v0 + v1) / 2 + _way(v1) == pytest.approx(room, abs=1e-12)
        assert drive_kernel._way_to_rest(v0, HARD, LONG) == pytest.approx(_way(v0), abs=1e-15)
        q = rng.uniform(-STOP, STOP)
        up, down = (min(QUICK, drive_kernel._fastest(side * v0, STOP - side * q, HARD, LONG)) for side in (1, -1))
        assert drive_kernel._speeds(q, v0, ROWS, LONG, 0) == pytest.approx((-down, up), abs=1e-12)


def _fhan(error: float, speed: float, top: float, h: float) -> float:
    """The form that Han prints (2009, equation 24), with signs in the place of cases."""
    d = top * h**2
    a0 = h * speed
    y = error + a0
    a1 = math.sqrt(d * (d + 8 * abs(y)))
    a2 = a0 + np.sign(y) * (a1 - d) / 2
    sy = (np.sign(y + d) - np.sign(y - d)) / 2
    a = (a0 + y - a2) * sy + a2
    sa = (np.sign(a + d) - np.sign(a - d)) / 2
    return float(-top * (a / d - np.sign(a)) * sa - top * np.sign(a))


def test_a_reference_beyond_the_limits_is_approached_by_han_s_law_within_the_speeds_that_leave_room() -> None:
    rng, held_back = np.random.default_rng(3), 0
    for _ in range(600):
        made = Drive(ONE, LONG)
        q0, v0 = _states(rng)
        mean = rng.uniform(-1, 1)
        made.state[:, 0] = q0, v0, mean
        near = rng.choice([0.002, 0.05, 1.0])
        q, v, a = q0 + near * rng.normal(), v0 + near * rng.normal(), 10 * near * rng.normal()
        gain = made.follow(*(np.array([one]) for one in (q, v, a)))
        if _excess(q0, v0, q, v) > 0:
            held_back += 1
            behind, slower = q - LONG * v + LONG**2 * a / 2, v - LONG * a
            desired = v0 + LONG * (a + _fhan(q0 - behind, v0 - slower, max(HARD - abs(a), 0.2 * HARD), LONG))
            v = np.clip(desired, v0 - HARD * LONG, v0 + HARD * LONG)
            v = np.clip(v, *drive_kernel._speeds(q0, v0, ROWS, LONG, 0))
            q = np.clip(q0 + LONG * (v0 + v) / 2, -STOP, STOP)
            assert made.limited
        assert made.state[:, 0] == pytest.approx([q, v, (q - q0) / LONG], abs=1e-9)
        assert gain[0] == pytest.approx(((q - q0) / LONG - mean) / LONG, abs=1e-6)
    assert held_back > 200


def test_the_state_that_is_sent_is_the_nearest_that_can_be_reached() -> None:
    """Speed by clipping; of the places that can be reached with that, on a fine grid, none is nearer."""
    rng = np.random.default_rng(4)
    for _ in range(120):
        q0, v0 = _states(rng)
        q, v = q0 + 0.03 * rng.normal(), v0 + 0.3 * rng.normal()
        sent, speed = np.empty(1), np.empty(1)
        begin, wish = np.array([[q0], [v0]]), np.array([[q], [v]])
        drive_kernel.nearest_state(begin[0], begin[1], wish[0], wish[1], ROWS, LONG, sent, speed)
        if drive_kernel._within(q0, v0, q, v, ROWS, LONG, 0):
            assert (sent[0], speed[0]) == (q, v)
            continue
        v = np.clip(np.clip(v, v0 - HARD * LONG, v0 + HARD * LONG), *drive_kernel._speeds(q0, v0, ROWS, LONG, 0))
        assert speed[0] == pytest.approx(v, abs=1e-12)
        grid = q0 + LONG * (v0 + v) / 2 + HARD * LONG**2 / 6 * np.linspace(-1, 1, 201)
        can = [one for one in grid if drive_kernel._within(q0, v0, one, v, ROWS, LONG, 0)]
        assert abs(sent[0] - q) <= min([abs(one - q) for one in can], default=math.inf) + 1e-9
        assert abs(sent[0]) <= STOP


def test_a_drive_begins_with_all_the_speed_that_leaves_room_to_brake_and_no_more() -> None:
    made = Drive(ONE, LONG)
    for q in (-0.7, -0.45, 0.0, 0.47, 0.4999):
        for wish in (-9.0, -0.1, 9.0):
            made.reset(np.array([q]), np.array([wish]))
            (at,), (v,) = made.position_rad, made.velocity_rad_s
            room = STOP - at if wish > 0 else STOP + at
            most = min(QUICK, math.sqrt(2 * HARD * max(room - HARD * LONG**2 / 8, 0.0)))
            assert at == max(q, -STOP)
            assert v == pytest.approx(np.sign(wish) * min(most, abs(wish)))
            assert made.state[drive_kernel.MEAN, 0] == v
