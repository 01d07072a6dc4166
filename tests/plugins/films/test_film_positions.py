"""One camera's depth of a ball, by its size."""

import functools

import numpy as np

from kendama_cli.plugins.films.ball_film import FilmTrack
from kendama_cli.plugins.films.film_positions import from_one
from tests.vision.scenes import stereo

RADIUS_M, ROPE_M, OFF_M = 0.03, 0.4, 0.02


@functools.cache
def swing(off_m=OFF_M, tie_speed_m_s=0.0):
    """A camera, its track of an elliptic swing in a plane turned by 20 degrees, and the true depths (n,)."""
    camera, rng = stereo((-0.1, 0.02, 0.0, 0.0, 0.0))[0], np.random.default_rng(10700)
    t_s = np.arange(80) / 30.0
    phase = np.sqrt(9.81 / ROPE_M) * t_s
    angle, off = 0.75 * np.cos(phase), off_m * np.sin(phase)
    along = np.sqrt(ROPE_M**2 - off**2)
    turn = np.deg2rad(20.0)
    across = np.array([np.cos(turn), np.sin(turn), 0.0])
    normal = np.array([-np.sin(turn), np.cos(turn), 0.0])
    ball = (along * np.sin(angle))[:, None] * across + off[:, None] * normal + [0.0, 0.0, 0.3]
    ball[:, 2] -= along * np.cos(angle)
    ball[:, 0] += tie_speed_m_s * t_s
    depth = camera.depth_m(ball)
    rays = (ball - camera.position_in_world_m) @ camera.world_to_camera.T / depth[:, None]
    radius = 600 * RADIUS_M / depth * (1 + np.linalg.norm(rays, axis=1)) / 2
    sphere = 1 - (radius[:, None] / 600) ** 2  # a disc's centre lies farther out than its sphere's
    disc = camera.center_px + (camera.project(ball) - camera.center_px) / sphere
    return (
        camera,
        FilmTrack(
            "film",
            np.arange(len(t_s), dtype=float),
            t_s,
            disc + 0.1 * rng.standard_normal(disc.shape),
            np.tile(0.01 * np.eye(2), (len(t_s), 1, 1)),
            radius + 0.1 * rng.standard_normal(len(t_s)),
            np.ones(len(t_s)),
        ),
        depth,
    )


def depth_errors_m(ball_radius_m):
    camera, track, depth = swing()
    found = from_one(track, camera, ball_radius_m)
    return found, camera.depth_m(found.position_m) - depth


def test_depth_is_that_of_a_ball_as_large_as_it_looks_and_errors_are_as_large_as_said():
    camera, *_ = swing()
    found, error = depth_errors_m(RADIUS_M)
    forward = camera.world_to_camera[2]
    sigma = np.sqrt(np.einsum("i,nij,j->n", forward, found.covariance_m2, forward))
    assert np.abs(np.mean(error)) < 0.004  # 0.1 px of 12 in 80 frames
    assert np.mean((error / sigma) ** 2) < 3.0


def test_a_diameter_3_percent_wrong_shifts_depth_by_3_percent():
    _, right = depth_errors_m(RADIUS_M)
    _, wrong = depth_errors_m(RADIUS_M / 1.03)
    depth = swing()[2]
    assert np.allclose(wrong - right, (1 / 1.03 - 1) * (depth + right), atol=1e-9)
