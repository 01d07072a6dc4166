"""How large a ball of several colours is in each camera's image, as two cameras that see it tell."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.interface import Sighting
from kendama_cli.vision.triangulation import sight_rows, triangulate

SAME_MOMENT_S = 1e-4
PAINTED_IMAGES = 3
"""A ball has several colours once so many of a flight's images say so."""
YOUNG_S = 0.1
"""A ball comes nearer by less than one part in a hundred in so long, as a rule."""


class PaintedSize:
    """Triangulates the newest pair of sightings of one moment; the ball's radius ``ball_radius_m`` does the rest.

    A ball radius that was measured wrong by more than a per cent or so spoils the circles of balls of several colours,
    where an image shows the rim on one side only; those of one colour are as good as before.
    """

    def __init__(self, cameras: Mapping[str, CameraModel], ball_radius_m: float) -> None:
        self._cameras, self._ball_radius_m = cameras, ball_radius_m
        self.reset()

    def reset(self) -> None:
        """Begin a new flight."""
        self._images = 0
        self._newest: dict[str, tuple[float, Sighting]] = {}
        self._ball: tuple[float, Array] | None = None

    def see(self, camera: str, t_s: float, seen: Sighting) -> None:
        """Take what one image shows."""
        self._images += seen.painted
        self._newest[camera] = t_s, seen
        if self._images < PAINTED_IMAGES:
            return
        together = [
            sight_rows(self._cameras[name], one.centre_px, one.covariance_px2)
            for name, (own_s, one) in self._newest.items()
            if abs(own_s - t_s) < SAME_MOMENT_S
        ]
        place = triangulate(together)
        if place is not None:
            self._ball = t_s, place.position_m

    def radius_px(self, camera: str, t_s: float) -> float | None:
        """The ball's mean radius in an image of ``camera`` at ``t_s`` [px]; None where no two cameras saw it lately, or
        none has seen several colours."""
        if self._ball is None or abs(t_s - self._ball[0]) > YOUNG_S:
            return None
        model = self._cameras[camera]
        x, y, z = (float(value) for value in model.in_camera(self._ball[1])[0])
        if z <= 0:
            return None
        # far away, depth and radius are in inverse proportion
        ray, one_px = np.array([[x / z, y / z, 1.0]]), np.ones(1)
        return float(model.optics.depth_m(ray, one_px, self._ball_radius_m)[0]) / z
