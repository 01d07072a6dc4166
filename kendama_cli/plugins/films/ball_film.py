"""The ball in the film of one camera: candidates in every frame, then the motion that explains most of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from kendama_cli.plugins.films.ball_box import TrainedImage
from kendama_cli.plugins.films.ball_region import placed
from kendama_cli.plugins.films.image_track import track
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.detection.interface import Detector, Image, Sighting

CANDIDATES = 6
Frames = Callable[[], Iterable[tuple[float, Image]]]
"""Returns the times [s] and images of a film, from its first frame on."""


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


def film_track(
    name: str, frames: Frames, detector: Detector, threshold: float, taught: Sequence[TrainedImage] = ()
) -> FilmTrack:
    """Track the ball through ``frames``.

    If boxes in the images ``taught`` the detector, the film is read again, and sightings go to the disc that the ball's
    colours fill.
    """
    times: list[float] = []
    candidates: list[Sequence[Sighting]] = []
    for t_s, pixels in frames():
        times.append(t_s)
        candidates.append(list(islice(detector.candidates(pixels), CANDIDATES)))
    seen = {one.frame: one.sighting for one in track(candidates, threshold) if one is not None}
    if taught:
        seen = placed(seen, (pixels for _, pixels in frames()), taught)
    return FilmTrack(
        name,
        np.array(list(seen), dtype=np.float64),
        np.array([times[frame] for frame in seen]),
        np.array([one.centre_px for one in seen.values()]).reshape(-1, 2),
        np.array([one.covariance_px2 for one in seen.values()]).reshape(-1, 2, 2),
        np.array([one.radius_px for one in seen.values()]),
        np.array([one.score for one in seen.values()]),
    )
