"""A ball in flight as two cameras see it, fed to the tracker moment by moment."""

import numpy as np

from kendama_cli.vision.detection.interface import Sighting
from kendama_cli.vision.prediction.catch_pose import CatchPoseEstimator
from kendama_cli.vision.prediction.onset import FreeFlightOnset
from kendama_cli.vision.prediction.release import draw_release
from kendama_cli.vision.prediction.tracker import BallTracker, sphere_centre
from tests.vision.scenes import game, predict, stereo

CAMERAS = stereo()
BLACK = np.zeros((40, 40, 3), dtype=np.uint8)


class Script:
    """A detector that finds ``answer``, whatever the image, and keeps the hints that it is given."""

    def __init__(self):
        self.answer = None
        self.hints = []

    def candidates(self, pixels, origin_px=(0, 0), hint=None):
        self.hints.append(hint)
        return iter(() if self.answer is None else (self.answer,))


def sighting(pixel, sigma_px=0.1):
    return Sighting(np.asarray(pixel, dtype=float), sigma_px**2 * np.eye(2), 8.0, 1.0)


def tracker(onset=True, detector=None):
    drag_per_s, drag_per_m = game().drag_per_mass
    estimator = CatchPoseEstimator(game().gravity_m_s2, drag_per_s, game().cup.rim_m, drag_per_m=drag_per_m)
    test = FreeFlightOnset(predict().onset, estimator.flight) if onset else None
    return BallTracker(CAMERAS, lambda: detector or Script(), estimator, test)


def shown(ball_m, rng, cameras=CAMERAS):
    """What every camera says of a ball at ``ball_m``."""
    seen = {}
    for camera in cameras:
        pixel = camera.project(ball_m)[0]
        disc = pixel + (pixel - sphere_centre(camera, pixel, 8.0)) + 0.1 * rng.standard_normal(2)
        seen[camera.name] = sighting(disc)
    return seen


def fly(made, release, rng, begin_s, end_s, spoil=None):  # noqa: PLR0917
    """Feed a release at 120 fps, each moment as ``spoil`` turns (t, sightings) into others; (time, pose) of each."""
    poses = []
    for t in np.arange(begin_s, end_s, 1 / 120):
        seen = shown(release.ball_m(t), rng)
        poses.append((t, made.update(t, seen if spoil is None else spoil(t, seen), release.tie_m(t))))
    return poses


def flight(seed):
    rng = np.random.default_rng(seed)
    return rng, draw_release(rng, predict().release, game(), 0.2)


def honest(pose, release):
    """Within five of its own standard deviations of the truth."""
    error = pose.position_m - release.crossing_m
    return np.linalg.norm(error) < 5 * np.sqrt(np.trace(pose.covariance_m2)) + 1e-3
