"""Finding free flights in recordings."""

import numpy as np
import pytest

from kendama_cli.plugins.calibration.flight_search import find_flights
from kendama_cli.plugins.shared.recordings.reader import RecordedTrack
from tests.plugins.shared.flights import session, throw


@pytest.mark.parametrize(("rate_hz", "sigma_m"), [(100.0, 1e-4), (120.0, 2e-3), (300.0, 3e-4), (500.0, 0.0)])
def test_every_throw_is_found_and_no_sample_of_hand_or_catch_is_in_it(rate_hz, sigma_m):
    """The end reaches the catch but for a few samples; the begin is only moved inward."""
    track, truth = session(np.random.default_rng(10100), 8, rate_hz=rate_hz, sigma_m=sigma_m)
    found = find_flights([track])
    assert len(found) == 8
    for flight, (begin, last) in zip(found, truth, strict=True):
        # noise hides what gravity does within 4 sigma: sqrt(8 sigma / g), 40 ms for 2 mm
        blind = np.sqrt(8 * (sigma_m + 2e-4) / 9.81) + 2 / rate_hz
        assert -blind < flight.begin_s - begin < 0.1
        assert -0.12 < flight.begin_s + flight.t_s[-1] - begin - last < 3 / rate_hz
        assert flight.t_s[0] == 0


@pytest.mark.parametrize("up", range(3))
@pytest.mark.parametrize("sign", [1, -1])
def test_whichever_axis_points_up_the_flights_stand_upright(up, sign):
    track, _ = session(np.random.default_rng(10101), 3)
    turned = np.roll(track.position_m * [1, 1, sign], up + 1, axis=1)
    flights = find_flights([RecordedTrack("ball", track.t_s, turned)])
    assert len(flights) == 3
    for flight in flights:
        assert np.polyfit(flight.t_s, flight.position_m[:, 2], 2)[0] == pytest.approx(-4.9, abs=0.3)
        assert np.abs(np.polyfit(flight.t_s, flight.position_m[:, :2], 2)[0]).max() < 0.3


def test_a_file_that_holds_the_flight_alone_is_taken_whole():
    t, points, last = throw(np.random.default_rng(10102), held_s=0.0)
    (flight,) = find_flights([RecordedTrack("ball", t, points)])
    assert flight.begin_s == 0
    assert last - flight.t_s[-1] < 3 / 120


def test_unseen_samples_and_gaps_do_not_invent_flights():
    track, _ = session(np.random.default_rng(10103), 2)
    points = track.position_m.copy()
    points[::7] = np.nan
    assert len(find_flights([RecordedTrack("ball", track.t_s, points)])) == 2
    points[:] = np.nan
    assert find_flights([RecordedTrack("ball", track.t_s, points)]) == []
    assert find_flights([]) == []


def test_a_pendulum_a_hand_and_a_resting_point_do_not_fly():
    t = np.arange(0, 10, 1 / 120)
    angle = 0.8 * np.sin(4.9 * t)
    pendulum = 0.4 * np.column_stack([np.sin(angle), 0 * t, -np.cos(angle)])
    hand = np.column_stack([0.3 * np.sin(3 * t), 0.2 * np.cos(2 * t), 0.1 * np.sin(5 * t)])
    assert (
        find_flights([RecordedTrack("a", t, pendulum), RecordedTrack("b", t, hand), RecordedTrack("c", t, 0 * hand)])
        == []
    )


def test_a_throw_that_is_lost_before_it_falls_has_no_end_to_foretell():
    t, points, _ = throw(np.random.default_rng(10104), last_s=None)
    rising = t < 0.1
    assert find_flights([RecordedTrack("ball", t[rising], points[rising])]) == []
