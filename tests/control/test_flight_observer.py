"""Estimates that observers of the flight make of tracked positions, period by period."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kendama_cli.control.flight_observer import MarkerObserver, ObservationLog, ObservedFrame, WatchedFlight
from kendama_cli.control.position_tracker import PositionTracker
from tests.control.observed_games import GAME, TRANSFER
from tests.control.seen_swings import ADAPT

H, RATE_PERIODS = 0.004, 5


def exchanged(t_s: float, ball_m: Any) -> Any:
    state = SimpleNamespace(ball_in_world_m=np.array(ball_m), cup_in_world_m=np.array([0.1, 0.2, 0.9]))
    return SimpleNamespace(t_s=t_s, state=state)


def test_a_watched_flight_tells_its_observer_angle_and_rate_until_the_ball_flies() -> None:
    """A ball that circles the tie point at 3 rad/s; the rate is that over the last five periods."""
    swung: list[Any] = []
    observed = SimpleNamespace(free_s=None)
    observer: Any = SimpleNamespace(
        begin=lambda seed, *, pictured: None, swinging=swung.append, flying=lambda step: "told", observed=observed
    )
    watched = WatchedFlight(observer)
    circle = lambda t: [0.1 + 0.3 * np.sin(3 * t + t * t), 0.2, 0.9 - 0.3 * np.cos(3 * t + t * t)]  # noqa: E731
    watched.begin(exchanged(7.0, circle(0.0)), 1)
    for k in range(1, 12):
        assert watched.look(exchanged(7.0 + H * k, circle(H * k))) is None
    times = H * np.arange(1, 12)
    assert [one.t_s for one in swung] == pytest.approx(times)
    assert [one.state.angle_rad for one in swung] == pytest.approx(3 * times + times**2)
    angles = 3 * times + times**2
    assert swung[10].state.rate_rad_s == pytest.approx((angles[10] - angles[6]) / (4 * H))
    assert swung[2].state.rate_rad_s == pytest.approx((angles[2] - angles[0]) / (2 * H))
    assert swung[0].state.rate_rad_s == 0.0
    observed.free_s = 0.05
    assert watched.look(exchanged(7.1, circle(0.1))) is None
    assert watched.look(exchanged(7.2, circle(0.2))) == "told"


def test_a_marker_is_predicted_from_a_while_after_the_goal_on_where_its_parabola_comes_down() -> None:
    eyes, settings, rim_m = ADAPT.sensor_model, TRANSFER.observation, 1.0
    tracker = PositionTracker(eyes.onset, eyes.motion, GAME, rim_height_m=rim_m, sigma_m=eyes.sigma_m)
    observer = MarkerObserver(tracker, settings, rim_m=rim_m, catch_m=rim_m - 0.02)
    observer.swinging(SimpleNamespace(t_s=2.0))  # type: ignore[arg-type]
    prediction = None
    for k in range(60):
        t = H * k
        ball = [0.3 + 0.5 * t, 0.1 - 0.2 * t, 1.1 + 1.5 * t - 0.5 * 9.81 * t**2]
        seen = observer.flying(SimpleNamespace(t_s=2.0 + t, exchange=exchanged(2.0 + t, ball)))  # type: ignore[arg-type]
        assert seen is None or t >= settings.free_after_s
        prediction = seen or prediction
    assert prediction is not None
    assert observer.observed.free_s == pytest.approx(2.0 + H * np.ceil(settings.free_after_s / H - 1e-9))
    assert prediction.t_s == pytest.approx(2.0 + 59 * H)
    for pose, height_m in ((prediction.rim, rim_m), (prediction.catch, rim_m - 0.02)):
        fall = max(np.roots([-0.5 * 9.81, 1.5, 1.1 - height_m]))
        assert pose.t_s == pytest.approx(2.0 + fall, abs=1e-3)  # the estimator knows of the air
        assert pose.position_m == pytest.approx([0.3 + 0.5 * fall, 0.1 - 0.2 * fall, height_m], abs=2e-3)


def test_the_latency_of_a_camera_is_that_of_95_in_100_frames_in_its_periods() -> None:
    frames = [ObservedFrame(0.01 * k, 0.01 * k + 0.001 * k, "left", None if k % 3 else object()) for k in range(101)]  # type: ignore[arg-type]
    assert ObservationLog(frames=frames, period_s=0.02).latency_frames == pytest.approx(0.095 / 0.02)
    assert ObservationLog(frames=frames).seen == 34
    assert ObservationLog().latency_frames is None
