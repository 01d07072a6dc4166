"""From frames to the catching pose: detection, region of interest, onset of free flight, estimator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.artifacts.checks import Array
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.catch_pose import CatchPoseEstimator
from kendama_cli.vision.detector import BallDetector, Sighting
from kendama_cli.vision.onset import FreeFlightFound, FreeFlightOnset
from kendama_cli.vision.region import Region, around, whole
from kendama_cli.vision.triangulation import SightRows, sight_rows, triangulate

MARGIN_PX = 10.0
LOST_FRAMES = 5
"""After so many frames without the ball the whole image is searched again."""
SAME_MOMENT_S = 1e-4
TRUSTED_SIGMA_M = 0.02


@dataclass
class _Track:
    """What one camera saw last."""

    t_s: float
    centre_px: Array
    speed_px_s: Array
    radius_px: float
    lost: int


class BallTracker:
    """Follows the ball in every camera and feeds the estimator with free flight only.

    The onset test runs on points triangulated from images of one moment; without an ``onset`` every sighting counts
    as free flight from the start.
    """

    def __init__(
        self,
        cameras: Sequence[CameraModel],
        detector: BallDetector,
        estimator: CatchPoseEstimator,
        onset: FreeFlightOnset | None = None,
    ) -> None:
        self.cameras = {camera.name: camera for camera in cameras}
        self.estimator = estimator
        self.onset = onset
        self._detector = detector
        self.reset()

    def reset(self) -> None:
        """Begin a new flight."""
        self.found: FreeFlightFound | None = None
        self._tracks: dict[str, _Track] = {}
        self._waiting: list[tuple[float, SightRows]] = []
        self._expected: dict[str, Region] = {}
        self.estimator.reset()
        if self.onset is not None:
            self.onset.reset()

    def expect(self, ball_m: ArrayLike, half_px: float) -> None:
        """Begin the search about a roughly known place (3,), instead of in the whole image."""
        for name, model in self.cameras.items():
            pixel = model.project(ball_m)[0]
            if np.isfinite(pixel).all():
                self._expected[name] = around(pixel, half_px)

    def region(self, camera: str, t_s: float) -> Region:
        """Where to look for the ball at ``t_s``: about its foreseen place; the whole image when it was lost."""
        model = self.cameras[camera]
        image = whole(model.width_px, model.height_px)
        track = self._tracks.get(camera)
        if track is None and camera in self._expected:
            box = self._expected[camera].within(image)
            return image if box.empty else box
        if track is None or track.lost >= LOST_FRAMES:
            return image
        centre = self._foreseen(model, t_s)
        if centre is None:
            centre = track.centre_px + (t_s - track.t_s) * track.speed_px_s
        box = around(centre, 1.6 * track.radius_px + MARGIN_PX * (1 + track.lost)).within(image)
        return image if box.empty else box

    def look(self, camera: str, t_s: float, pixels: NDArray[np.uint8], origin_px: tuple[int, int]) -> Sighting | None:
        """Find the ball in one image; what is found is kept as this camera's track. Feeds nothing yet."""
        sighting = self._detector.find(pixels, origin_px)
        track = self._tracks.get(camera)
        self._expected.pop(camera, None)
        if sighting is None:
            if track is not None:
                track.lost += 1
            return None
        speed = np.zeros(2)
        if track is not None and track.lost < LOST_FRAMES and t_s > track.t_s:
            speed = (sighting.centre_px - track.centre_px) / (t_s - track.t_s)
        self._tracks[camera] = _Track(t_s, sighting.centre_px, speed, sighting.radius_px, 0)
        return sighting

    def update(self, t_s: float, sightings: Mapping[str, Sighting | None], tie_m: ArrayLike) -> CatchPose | None:
        """Take the sightings of one moment with the rope's tie point (3,) at that moment; tell the catching pose."""
        rows = [self._rows(name, seen) for name, seen in sightings.items() if seen is not None]
        if self.onset is not None and self.found is None:
            self._waiting += [(t_s, row) for row in rows]
            self._test(t_s, rows, tie_m)
        else:
            for row in rows:
                self.estimator.update_sight(t_s, row)
        return self.estimator.catch()

    def _test(self, t_s: float, rows: Sequence[SightRows], tie_m: ArrayLike) -> None:
        point = triangulate(rows)
        if point is None or self.onset is None:
            return
        self.found = self.onset.update(t_s, point.position_m, point.covariance_m2, tie_m)
        if self.found is None:
            return
        for t, row in self._waiting:
            if t >= self.found.since_s - SAME_MOMENT_S:
                self.estimator.update_sight(t, row)
        self._waiting = []

    def _rows(self, camera: str, seen: Sighting) -> SightRows:
        model = self.cameras[camera]
        return sight_rows(model, sphere_centre(model, seen.centre_px, seen.radius_px), seen.covariance_px2)

    def _foreseen(self, model: CameraModel, t_s: float) -> Array | None:
        state = self.estimator.state_at(t_s)
        pose = self.estimator.catch()
        if state is None or pose is None or np.trace(pose.covariance_m2) > TRUSTED_SIGMA_M**2:
            return None
        pixel = model.project(state[:3])[0]
        return pixel if np.isfinite(pixel).all() else None


def sphere_centre(camera: CameraModel, disc_px: ArrayLike, radius_px: float) -> Array:
    """The image (2,) of a sphere's centre, from the centre (2,) of its disc.

    A sphere seen under the half angle alpha at the angle theta off the axis has its disc's centre at
    tan(theta) cos^2(theta) / (cos^2(theta) - sin^2(alpha)); for a small ball alpha / cos(theta) is radius / focal.
    """
    shrink = 1 - (radius_px / float(camera.focal_px.mean())) ** 2
    return np.asarray(camera.center_px + shrink * (np.asarray(disc_px, dtype=np.float64) - camera.center_px))
