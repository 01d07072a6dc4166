"""Two films of one ball: exchanged cameras and films of two balls are refused, and disagreement widens covariances."""

import numpy as np
import pytest

from kendama_cli.devices.camera.calibration import camera_model
from kendama_cli.schema.settings import build
from kendama_cli.settings.camera import CameraModelSettings
from kendama_cli.vision.ball_film import FilmTrack
from kendama_cli.vision.film_agreement import agreed_positions
from kendama_cli.vision.film_positions import clock_offsets, from_several
from tests.cli.test_camera_seeing import camera

RATE_HZ, NOISE_PX, RADIUS_M = 30.0, 0.3, 0.03
SEEDS = range(20500, 20506)


@pytest.fixture(scope="module")
def cameras():
    return [camera_model(build(CameraModelSettings, camera(name, x), name)) for name, x in (("a", -0.4), ("b", 0.4))]


def throw(rng):
    start = np.array([-0.3, 0.1, -0.25]) + rng.normal(0, 0.05, 3)
    speed = np.array([0.5, -0.1, 2.4]) + rng.normal(0, 0.15, 3)
    return lambda t_s: start + speed * t_s - np.array([0, 0, 9.81]) * t_s**2 / 2


def film(model, place, rng, *, begin_s=0.0, off_px=0.0):
    """What a film of a throw of half a second gives, of which the times begin ``begin_s`` late."""
    times_s = np.arange(15) / RATE_HZ + begin_s
    centres = np.array([model.project(place(t_s))[0] for t_s in times_s]) + rng.normal(0, NOISE_PX, (15, 2))
    radius_px = np.array([300 * RADIUS_M / float(model.depth_m(place(t_s))) for t_s in times_s])
    centres[:, 1] += off_px
    covariance = np.tile(NOISE_PX**2 * np.eye(2), (15, 1, 1))
    frames = np.arange(15.0)
    return FilmTrack(
        model.name, frames, frames / RATE_HZ, centres, covariance, radius_px, np.ones(15), centres * np.nan
    )


def both(cameras, seed, **second):
    rng = np.random.default_rng(seed)
    place = throw(rng)
    return place, [film(cameras[0], place, rng), film(cameras[1], place, rng, **second)]


@pytest.mark.parametrize("seed", SEEDS)
def test_films_of_one_throw_agree_and_keep_their_covariance(cameras, seed):
    place, tracks = both(cameras, seed, begin_s=0.02)
    made = agreed_positions(tracks, cameras)
    plain = from_several(tracks, cameras, clock_offsets(tracks, cameras))
    grown = made.covariance_m2[:, 0, 0] / plain.covariance_m2[:, 0, 0]
    assert (grown >= 1 - 1e-9).all()
    assert grown.mean() < 2.5
    off = [np.linalg.norm(at - place(t_s)) for at, t_s in zip(made.position_m, made.t_s, strict=True)]
    assert np.median(off) < 0.02


def test_exchanged_cameras_are_refused(cameras):
    refused = 0
    for seed in SEEDS:
        _, tracks = both(cameras, seed)
        try:
            agreed_positions(tracks, cameras[::-1])
        except ValueError as wrong:
            refused += "much less with the cameras of 'a' and 'b' exchanged: exchange the films' names" in str(wrong)
    assert refused >= len(SEEDS) - 1  # a throw that is nearly its own mirror image tells nothing


def test_films_of_two_throws_give_no_track(cameras):
    refused = 0
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        tracks = [film(one, throw(rng), rng) for one in cameras]
        try:
            agreed_positions(tracks, cameras, same_clock=True)
        except ValueError as wrong:
            refused += "the films do not show one ball: its rays usually miss each other by " in str(wrong)
    assert refused >= len(SEEDS) - 1  # two throws may be alike


@pytest.mark.parametrize("off_px", [1.5, 2.5])
def test_covariance_grows_with_what_the_films_disagree_by(cameras, off_px):
    """A camera that is turned a little since it was calibrated: the errors stay within what is claimed."""
    claimed, grown = [], []
    for seed in SEEDS:
        _, tracks = both(cameras, seed, off_px=off_px)
        made = agreed_positions(tracks, cameras, same_clock=True)
        plain = from_several(tracks, cameras, np.zeros(1))
        assert np.allclose(made.position_m, plain.position_m)
        grown.append(np.median(made.covariance_m2[:, 2, 2] / plain.covariance_m2[:, 2, 2]))
        claimed.append(np.median(plain.chi_square))
    expected = 1 + (off_px / NOISE_PX) ** 2 / 2  # the vertical difference of two sights, by its variance
    assert np.median(grown) == pytest.approx(expected, rel=0.4)
    assert np.median(claimed) == pytest.approx(expected, rel=0.4)


def test_few_common_moments_are_no_track(cameras):
    _, tracks = both(cameras, 20510)
    first = FilmTrack(**{name: one if name == "name" else one[:9] for name, one in vars(tracks[0]).items()})
    second = FilmTrack(**{name: one if name == "name" else one[5:] for name, one in vars(tracks[1]).items()})
    with pytest.raises(ValueError, match=r"the films show the ball together at \d moments; 8 are the least"):
        agreed_positions([first, second], cameras, same_clock=True)
