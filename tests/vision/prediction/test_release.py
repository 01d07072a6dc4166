import dataclasses

import numpy as np
import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.physics.rope import CupProfile
from kendama_cli.physics.taut_rope import Ball, TautRope, rope_angle, rope_rate
from kendama_cli.vision.prediction.release import Release, draw_release
from tests.vision.scenes import game, predict


@pytest.fixture(scope="module")
def releases() -> list[Release]:
    return [draw_release(np.random.default_rng(seed), predict().release, game(), 0.25) for seed in range(40)]


def _way_m(release, t_s):
    """The rope's way round the cup from its tie to the ball, in the plane of the swing."""
    x, _, z = release.ball_m(t_s) - release.tie_m(t_s)
    return CupProfile.of(game().cup).path_length_m(x, 0.0, z)


def test_the_rope_is_taut_before_the_release_and_slack_until_the_crossing(releases):
    length = game().rope.length_m
    for release in releases:
        before = [_way_m(release, t) for t in np.linspace(-0.2, -1e-3, 20)]
        assert np.abs(np.array(before) - length).max() < 1e-4  # linear interpolation over 1 ms
        after = [np.linalg.norm(release.ball_m(t) - release.tie_m(t)) for t in np.linspace(0, release.crossing_s, 50)]
        assert max(after) <= length + 1e-6


def test_the_rope_pulls_by_at_least_six_until_it_lets_go(releases):
    """Pull = second difference of the ball's path less gravity, along the rope, just before the release."""
    h = 4e-3
    for release in releases:
        middle = release.ball_m(-h)
        acceleration = (release.ball_m(0.0) - 2 * middle + release.ball_m(-2 * h)) / h**2 - release.flight.gravity_m_s2
        along = release.tie_m(-h) - middle
        assert acceleration @ along / np.linalg.norm(along) > 5.5


def test_position_and_velocity_do_not_jump_at_the_release(releases):
    for release in releases:
        assert np.abs(release.ball_m(-1e-9) - release.ball_m(0.0)).max() < 1e-7
        before = (release.ball_m(-1e-3) - release.ball_m(-3e-3)) / 2e-3
        after = (release.ball_m(3e-3) - release.ball_m(1e-3)) / 2e-3
        assert np.abs(after - before).max() < 0.15  # 4 ms of up to 30 m/s^2


def test_apex_and_crossing_keep_to_the_settings(releases):
    wanted, rim = predict().release, game().cup.depth_m
    for release in releases:
        height = [release.ball_m(t)[2] - rim for t in np.linspace(0, release.crossing_s, 400)]
        assert wanted.apex_low_m - 5e-3 <= max(height) <= wanted.apex_high_m
        assert abs(release.crossing_m[2] - rim) < 1e-9


def test_an_apex_out_of_reach_is_reported():
    settings = dataclasses.replace(predict().release, apex_low_m=3.0, apex_high_m=4.0)
    with pytest.raises(ConfigError, match=r"apex 3\.0\.\.4\.0 m over the rim is out of reach of a rope of 0\.4 m"):
        draw_release(np.random.default_rng(0), settings, game(), 0.1)


def test_releases_fill_the_ranges_that_are_told_and_never_leave_them(releases):
    """Angle, rate, pull of the cup, its place and speed, sideways speed: all of 40 draws within, some near each end."""
    settings, rope, seen, rates = predict().release, TautRope.of(game()), [], []
    for one in releases:
        (across, lateral, above), velocity = one.start_m - one.cup_m, one.velocity_m_s - one.cup_velocity_m_s
        side = np.sign(across)
        angle, rate = rope_angle(across, above), rope_rate(Ball(across, above, velocity[0], velocity[2]))
        tie = one.taut_cup_m[-3:, 0]
        pull = (tie[0] - 2 * tie[1] + tie[2]) / (one.taut_s[-1] - one.taut_s[-2]) ** 2
        assert lateral == 0
        assert side * angle > 0 < side * rate
        assert abs(one.cup_acceleration_m_s2[0]) <= 8.0
        assert (one.cup_acceleration_m_s2[1:] == 0).all()
        assert abs(one.crossing_m[0] - one.cup_m[0]) <= 0.25
        assert one.tie_m(one.crossing_s)[0] == pytest.approx(one.crossing_m[0], abs=1e-9)
        assert rope.tension_m_s2(angle, rate, pull, game().gravity_m_s2) > 6.0 - 1e-6
        seen.append([np.rad2deg(abs(angle)), -side * pull, one.cup_m[0], one.cup_velocity_m_s[0], velocity[1]])
        rates.append(abs(rate))
    low = np.array([100, 2, -settings.cup_travel_m, -0.5, -settings.lateral_m_s])
    high = np.array([150, 8, settings.cup_travel_m, 0.5, settings.lateral_m_s])
    part = (np.array(seen) - low) / (high - low)
    assert part.min() > -1e-6
    assert part.max() < 1 + 1e-6
    assert (np.quantile(part, 0.1, axis=0) < [0.4, 0.6, 0.25, 0.25, 0.25]).all()
    assert (np.quantile(part, 0.9, axis=0) > [0.2, 0.7, 0.75, 0.75, 0.75]).all()
    assert (np.array(rates) >= 2.0).all()
    assert (np.array(rates) <= 7.0).all()


def test_the_swing_before_lasts_as_asked_sampled_every_millisecond_and_drifts_sideways(releases):
    for one in releases[:5]:
        assert one.taut_s[[0, -1]] == pytest.approx([-0.25, 0.0])
        assert np.diff(one.taut_s) == pytest.approx(1e-3)
        assert one.taut_ball_m[:, 1] == pytest.approx(one.velocity_m_s[1] * one.taut_s)
        assert one.ball_m(-0.0105) == pytest.approx((one.taut_ball_m[-11] + one.taut_ball_m[-12]) / 2, abs=1e-9)
