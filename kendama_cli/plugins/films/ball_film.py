"""The ball in the film of one camera: candidates in every frame, then the motion that explains most of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from kendama_cli.plugins.films.image_track import track
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.detection.interface import Detector, Image, Sighting

CANDIDATES = 6


@dataclass(frozen=True)
class FilmTrack:
    """The ball's sightings in one film: frame number, time [s], centre (n, 2) [px], its covariance (n, 2, 2) [px^2],
    radius [px] and score of each frame where it was seen."""

    name: str
    frame: Array
    t_s: Array
    centre_px: Array
    covariance_px2: Array
    radius_px: Array
    score: Array

    def exposed(self, camera: CameraModel) -> FilmTrack:
        """With the frames' times turned into those at which ``camera`` exposed the ball's rows."""
        return replace(self, t_s=camera.exposed_s(self.t_s, self.centre_px))


def film_track(name: str, frames: Iterable[tuple[float, Image]], detector: Detector, threshold: float) -> FilmTrack:
    """Track the ball through ``frames``, each with its time [s]."""
    times: list[float] = []
    candidates: list[Sequence[Sighting]] = []
    for t_s, pixels in frames:
        times.append(t_s)
        candidates.append(list(islice(detector.candidates(pixels), CANDIDATES)))
    seen = [one for one in track(candidates, threshold) if one is not None]
    return FilmTrack(
        name,
        np.array([one.frame for one in seen], dtype=np.float64),
        np.array([times[one.frame] for one in seen]),
        np.array([one.sighting.centre_px for one in seen]).reshape(-1, 2),
        np.array([one.sighting.covariance_px2 for one in seen]).reshape(-1, 2, 2),
        np.array([one.sighting.radius_px for one in seen]),
        np.array([one.sighting.score for one in seen]),
    )
