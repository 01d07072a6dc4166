"""Image of a moving ball by a rolling shutter: its position when its own row is exposed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.plugins.films.ball_film import FilmTrack
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.prediction.free_flight import FreeFlight

HELD_S, RADIUS_M = 0.5, 0.03
FLIGHT = FreeFlight(np.array([0.0, 0.0, -9.81]), 0.0, 0.008)


def seen_px(camera: CameraModel, ball_m: Callable[[float], Array], frame_s: float) -> Array:
    """The pixel p (2,) of the ball's centre in a frame: p = project(ball(t)) with t = exposed(frame_s, p)."""
    t_s = frame_s
    for _ in range(20):
        pixel = camera.project(ball_m(t_s))[0]
        t_s = float(camera.exposed_s(frame_s, pixel))
    return np.asarray(pixel)


@dataclass(frozen=True)
class Throws:
    """A ball that is held, thrown and caught, again and again: places and velocities at the throws, and their times."""

    start_m: Array
    velocity_m_s: Array
    begin_s: Array
    flown_s: Array

    @property
    def end_s(self) -> float:
        return float(self.begin_s[-1] + self.flown_s[-1]) + HELD_S

    def ball_m(self, t_s: float) -> Array:
        """The ball's centre (3,); held, it goes straight from where it was caught to where it is thrown next."""
        k = int(np.searchsorted(self.begin_s, t_s)) - 1
        if k < 0:
            return self.start_m[0]
        flown_s = float(min(t_s - self.begin_s[k], self.flown_s[k]))
        place = FLIGHT.position_m(self.start_m[k], self.velocity_m_s[k], flown_s)
        rest_s = t_s - self.begin_s[k] - flown_s
        if rest_s > 0 and k + 1 < len(self.begin_s):
            place = place + (self.start_m[k + 1] - place) * rest_s / HELD_S
        return np.asarray(place)


def throws(rng: np.random.Generator, count: int, up_m_s: tuple[float, float] = (1.8, 2.8)) -> Throws:
    """Before ``tests.vision.scenes.stereo``, caught at about the height of the throw."""
    start = rng.uniform([-0.25, -0.1, -0.25], [0.25, 0.1, -0.05], (count, 3))
    velocity = rng.uniform([-0.4, -0.2, up_m_s[0]], [0.4, 0.2, up_m_s[1]], (count, 3))
    flown = [float(FLIGHT.descent_s(a, v, a[2] - 0.05) or 0.0) for a, v in zip(start, velocity, strict=True)]
    begin = HELD_S + np.concatenate([[0.0], np.cumsum(np.array(flown[:-1]) + HELD_S)])
    return Throws(start, velocity, begin, np.array(flown))


def filmed(
    cameras: Sequence[CameraModel],
    made: Throws,
    rng: np.random.Generator,
    *,
    rate_hz: float = 30.0,
    sigma_px: float = 0.2,
    ahead_s: Sequence[float] = (0.0, 0.0),
) -> list[FilmTrack]:
    """Each camera's sightings, its clock ``ahead_s`` of the true time."""
    films = []
    for camera, ahead in zip(cameras, ahead_s, strict=False):
        frame_s = np.arange(0.1, made.end_s, 1 / rate_hz) + rng.uniform(0, 1 / rate_hz)
        centre = np.array([seen_px(camera, made.ball_m, t_s) for t_s in frame_s])
        radius = np.array([camera.size_px(made.ball_m(float(t)), RADIUS_M) for t in camera.exposed_s(frame_s, centre)])
        around, n = camera.optics, len(frame_s)
        centre = 2 * centre - [around.sphere_centre(one, size) for one, size in zip(centre, radius, strict=True)]
        films.append(
            FilmTrack(
                camera.name, np.arange(n, dtype=float), frame_s + ahead, centre + rng.normal(0, sigma_px, (n, 2)),
                np.tile(sigma_px**2 * np.eye(2), (n, 1, 1)), radius + rng.normal(0, 0.12, n), np.ones(n),
            )
        )  # fmt: skip
    return films
