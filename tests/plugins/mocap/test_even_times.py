"""Stamps of arrival are put back to the steady rate of the tracker, and other stamps are left alone."""

import numpy as np
import pytest

from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.devices.demonstrator.tidy import even_times
from kendama_cli.errors import InputError
from tests.plugins.mocap.test_body import settings
from tests.plugins.swing_server import SWING

PERIOD_S = 0.01
SENT_S = PERIOD_S * np.arange(250)


def late(rng, count=250, mean_s=0.0012):
    return np.minimum(rng.exponential(mean_s, count), 0.9 * PERIOD_S)


@pytest.mark.parametrize("seed", range(10000, 10020))
def test_delays_now_and_then_are_taken_out(seed):
    made = even_times(SENT_S + late(np.random.default_rng(seed)))
    assert np.ptp(np.diff(made)) < 1e-9
    # their mean stays, as a delay, and the line's ends are known to a few tenths of a millisecond
    assert np.abs(made - SENT_S - 0.0012).max() < 0.0006


@pytest.mark.parametrize("seed", range(10000, 10010))
def test_missing_poses_stay_missing(seed):
    rng = np.random.default_rng(seed)
    kept = np.delete(np.arange(250), [40, 41, 120, 200])
    made = even_times((SENT_S + rng.uniform(0, 0.2 * PERIOD_S, 250))[kept])
    assert np.rint(np.diff(made) / PERIOD_S) == pytest.approx(np.diff(kept))
    assert np.abs(made - SENT_S[kept] - 0.1 * PERIOD_S).max() < 0.05 * PERIOD_S


def held_back(stamps_s, first, lasted_s):
    """As a stalled computer hears of them: those of the stall all at its end."""
    end_s = SENT_S[first] + lasted_s
    late = (stamps_s >= SENT_S[first]) & (stamps_s < end_s)
    return np.where(late, end_s + 1e-5 * np.arange(len(stamps_s)), stamps_s)


@pytest.mark.parametrize("seed", range(10000, 10020))
def test_a_stall_of_the_computer_is_no_jump(seed):
    rng = np.random.default_rng(seed)
    stamps_s = held_back(SENT_S + late(rng), rng.integers(5, 200), rng.uniform(0.06, 0.45))
    made = even_times(np.maximum.accumulate(stamps_s) + 1e-7 * np.arange(250))
    assert np.ptp(np.diff(made)) < 1e-9
    assert np.abs(made - SENT_S - 0.0012).max() < 0.001


@pytest.mark.parametrize("seed", range(10000, 10010))
def test_poses_that_a_stall_lost_are_not_taken_for_late(seed):
    """A tracker that was stalled itself goes on from where the hand is then."""
    rng = np.random.default_rng(seed)
    first, count = int(rng.integers(40, 180)), int(rng.integers(7, 40))
    kept = np.delete(np.arange(250), np.arange(first, first + count))
    made = even_times((SENT_S + rng.uniform(0, 0.2 * PERIOD_S, 250))[kept])
    assert np.rint(np.diff(made) / PERIOD_S) == pytest.approx(np.diff(kept))


@pytest.mark.parametrize(
    "stamps_s",
    [
        SENT_S,
        np.delete(SENT_S, [40, 41]),
        np.cumsum(np.random.default_rng(10000).exponential(PERIOD_S, 250)),
        np.concatenate([SENT_S[:125], SENT_S[125] + 1.1 * SENT_S[:125]]),
        SENT_S[:5],
    ],
    ids=["steady", "missing", "never steady", "slower after a while", "few"],
)
def test_other_stamps_are_left_alone(stamps_s):
    assert even_times(stamps_s) is None


def kept_stream(tmp_path):
    """A stream that was kept: the bundled swing, two poses of which arrived together at its fastest."""
    rows = SWING.copy()
    fastest = int(np.linalg.norm(np.diff(rows[:, 1:], axis=0), axis=1).argmax())
    rows[fastest, 0] += 0.0095
    lines = [",".join([*(f"{value:.6f}" for value in row), "1,0,0,0"]) for row in rows]
    (tmp_path / "mocap.csv").write_text("\n".join(["# cup", "t_s,x_m,y_m,z_m,qw,qx,qy,qz", *lines]) + "\n")
    return tmp_path / "mocap.csv"


def test_two_poses_that_arrive_together_are_no_jump_and_it_is_told(tmp_path):
    path = kept_stream(tmp_path)
    (hand,) = open_demonstrators(settings(path))
    assert [one.t_s for one in hand.samples()] == pytest.approx(SWING[:, 0], abs=1e-4)
    assert any("mocap: stamps stray by up to 9.5 ms from a steady 100.0 Hz, whose" in one for one in hand.warnings)
    with pytest.raises(InputError, match=r"the position jumps by|an acceleration of"):
        open_demonstrators(settings(path, times="stamps"))
