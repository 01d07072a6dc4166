"""A player's table: tries begin, end, are kept and eased, whatever the line does."""

import dataclasses

import numpy as np
import pytest

from kendama_cli.errors import UsageError
from kendama_cli.plugins.teleoperation.play.conditions import Conditions
from kendama_cli.plugins.teleoperation.play.table import HandSample
from kendama_cli.simulation.dart.hand_world import HandWorld
from tests.plugins.teleoperation.play.table_top import GAME, caught_swing, drag, hand, swing, table


@pytest.fixture(scope="module")
def caught():
    return caught_swing()


def test_a_swing_is_caught_and_kept_from_rest_to_the_cup(caught):
    scale, samples = caught
    t_s, cup, ball = samples[:, 0], samples[:, 1:4], samples[:, 8:11]
    assert np.ptp(np.diff(t_s)) < 1e-9
    assert np.abs(ball[0] - cup[0] - [0, 0, -GAME.rope.length_m]).max() < 0.01
    assert np.linalg.norm(ball[-1] - cup[-1]) < GAME.cup.depth_m
    assert t_s[-1] < swing()[0][-1] * scale


def test_what_is_kept_is_what_was_dragged(caught):
    scale, samples = caught
    t_s, places = swing()
    errors = []
    for shift_s in np.arange(0.0, 1.0, 0.001):  # the demonstration begins at the onset
        dragged = np.column_stack([np.interp((samples[:, 0] + shift_s) / scale, t_s, column) for column in places.T])
        errors.append(np.abs(samples[:, (1, 3)] - dragged).max())
    assert min(errors) < 1e-3


def test_when_messages_come_changes_nothing(caught):
    scale, samples = caught
    for several in (7, 25):
        at, kept = table()
        drag(at, hand(scale), several)
        # Bullet takes contacts in an order of its own: rounding differs, nothing else
        assert kept[0][2] == pytest.approx(samples, abs=1e-9)


def test_samples_that_come_late_take_back_what_was_guessed(caught):
    # every message is 50 to 150 ms late, and until it comes the page guesses in each frame that the hand stands still
    scale, samples = caught
    rng = np.random.default_rng(10002)
    at, kept = table()
    at.hand(hand(scale)[:1], held=True, now_s=0.0)
    waiting, last = [], hand(scale)[0]
    for k, one in enumerate(hand(scale)[1:]):
        if kept:
            break
        waiting.append(one)
        if k % 2:
            guess = dataclasses.replace(last, t_s=one.t_s)
            at.hand([guess], held=True, now_s=one.t_s, guessed=True)
        if rng.random() < 0.1:
            at.hand(waiting, held=True, now_s=one.t_s)
            waiting, last = [], waiting[-1]
    assert kept[0][0] == "caught"
    both = min(len(kept[0][2]), len(samples)) - 80  # the catch may be seen on a guess
    assert np.abs(kept[0][2][:both, 1:4] - samples[:both, 1:4]).max() < 1e-9
    assert np.abs(kept[0][2][:both, 8:11] - samples[:both, 8:11]).max() < 1e-6


def test_a_hand_that_stands_still_leaves_the_ball_swinging_without_a_halt():
    at, _ = table()
    drag(at, hand(1.0)[:150])
    last, seen = hand(1.0)[149], []
    for k in range(30):
        one = dataclasses.replace(last, t_s=last.t_s + 0.016 * (k + 1))
        at.hand([one], held=True, now_s=one.t_s, guessed=True)
        seen.append(at.world.ball.position_m[0])
    assert at.world.t_s == pytest.approx(last.t_s + 0.48 - hand()[0].t_s, abs=1.1e-3)
    assert np.abs(np.diff(seen)).min() > 0
    # it moves on after a long rest: the rest is a rest, not the first part of the motion
    moved = dataclasses.replace(last, t_s=last.t_s + 0.49, aside_m=last.aside_m + 0.02)
    at.hand([moved], held=True, now_s=moved.t_s)
    assert at._record._rows[-8][1] == pytest.approx(last.aside_m, abs=1e-3)


def test_every_millisecond_of_the_hand_is_simulated_once():
    at, _ = table()
    samples = hand(1.0, wait_s=0.0)
    drag(at, samples, 3)
    assert at.steps == int((samples[-1].t_s - samples[0].t_s) * 1000 + 1e-6)


def test_no_drag_gives_no_try():
    at, kept = table()
    still = [dataclasses.replace(one, aside_m=0.0, up_m=0.0) for one in hand()]
    drag(at, still)
    at.stop("the page was closed")
    assert kept == []


def test_letting_go_ends_a_try_and_the_ball_hangs_again():
    at, kept = table()
    samples = hand(0.8)  # too fast to catch
    drag(at, samples)
    assert (at.phase, kept) == ("playing", [])
    last = samples[-1]
    for k in range(200):
        one = dataclasses.replace(last, t_s=last.t_s + 0.016 * (k + 1))
        at.hand([one], held=False, now_s=one.t_s)
    assert [outcome for outcome, _, _ in kept] == ["missed"]
    assert (at.phase, at.outcome, at.world.t_s) == ("ready", "missed", 0.0)


def test_a_hand_that_falls_silent_leaves_what_it_did_until_then():
    at, kept = table()
    drag(at, hand()[:200])
    at.hand([dataclasses.replace(hand()[200], t_s=99.0)], held=True, now_s=99.0)
    assert kept[0][0] == "interrupted"
    assert kept.reasons == ("nothing was heard of the hand for 92.41 s",)
    assert kept[0][2][-1, 0] > 0.8


def test_a_long_try_ends():
    at, kept = table(max_attempt_s=1.5)
    drag(at, hand())
    assert at.outcome == "missed"
    assert kept[0][2][-1, 0] <= 1.5


def test_time_that_runs_ahead_of_the_clock_is_refused():
    at, _ = table()
    drag(at, hand()[:240], clock_s=0.0)
    with pytest.raises(UsageError, match="ahead of the clock"):
        drag(at, hand()[240:270], clock_s=0.0)
    assert at.steps <= 2000


def row(t_s, aside_m=0.0):
    return HandSample(t_s, aside_m, 0.0, 0.0)


@pytest.mark.parametrize(
    "samples",
    [
        [row(0), row(60), row(0)],
        [row(0), row(1e9), row(0)],
        [row(1e9), row(2e9), row(1e9)],
        [*(row(0.24 * k) for k in range(999)), row(0)],
        [*(row(0.24 * k) for k in range(500)), *(row(-0.24 * k) for k in range(500))],
    ],
)
def test_times_that_rise_and_fall_again_in_one_message_buy_no_time_of_the_machine(samples):
    at, _ = table()
    with pytest.raises(UsageError, match="ahead of the clock"):
        at.hand(samples, held=True, now_s=1e6)
    assert at.steps == 0
    at.hand([row(3e9), row(3e9 + 0.1)], held=True, now_s=1e6)  # who is refused once may play on
    assert at.steps == pytest.approx(100, abs=1)


def test_what_is_guessed_and_taken_back_again_and_again_buys_no_time_of_the_machine(monkeypatch):
    at, _ = table()
    step, steps = HandWorld.step, []

    def counted(world, place):
        steps.append(1)
        step(world, place)

    monkeypatch.setattr(HandWorld, "step", counted)
    at.hand([row(0.0)], held=True, now_s=0.0)
    clock_s, k = 0.0, 0
    try:
        while clock_s < 1.0:  # 1000 pairs of small messages in a second of the clock
            at.hand([row(0.001 * k + 0.2)], held=True, now_s=clock_s, guessed=True)
            at.hand([row(0.001 * k, 1e-5 * k)], held=True, now_s=clock_s)
            clock_s, k = clock_s + 0.001, k + 1
    except UsageError:
        pass
    assert len(steps) <= 1000 * 3.0 * (2.0 + 1.0)  # the clock's second and what may come at once, three times


def test_the_cup_stays_within_reach():
    at, _ = table()
    far = [HandSample(0.01 * k, 0.02 * k, 0.02 * k, 0.1 * k) for k in range(200)]
    drag(at, far)
    reach = at._settings.reach
    assert at.world.place == pytest.approx([reach.lateral_m, 0.0, reach.up_m, reach.tilt_rad])


@pytest.mark.parametrize("eased", [Conditions(0.4, 1.0, 1.0), Conditions(1.0, 0.7, 1.0), Conditions(0.5, 1.2, 1.0)])
def test_an_eased_swing_is_kept_as_the_robot_needs_it(caught, eased):
    # lengths and times that fit the eased game: the same swing, so the same ball, but for air, stretch and the ball's
    # and cup's own size, which do not grow with the rope
    scale, samples = caught
    at, kept = table()
    at.change(eased)
    drag(at, hand(scale / eased.time_scale, rate_hz=1000.0, lengths=eased.rope_scale))
    at.stop("the page was closed")
    made = kept[0][2]
    until_s = min(made[-1, 0], samples[-1, 0]) - 0.5  # before the catch
    t_s = np.arange(0.1, until_s, 0.01)
    shifts = np.arange(-0.1, 0.1, 0.002)
    differ = [
        max(
            np.abs(np.interp(t_s + s, made[:, 0], made[:, c]) - np.interp(t_s, samples[:, 0], samples[:, c])).max()
            for c in (1, 3)
        )
        for s in shifts
    ]
    assert min(differ) < 3e-3


def test_conditions_beyond_what_is_allowed_are_brought_within():
    at, _ = table()
    at.change(Conditions(0.0, 9.0, 0.1))
    assert at.conditions == Conditions(0.3, 1.2, 1.0)
