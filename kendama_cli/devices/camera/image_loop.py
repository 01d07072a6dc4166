"""The one loop that takes images: of the flights that predict studies, of games, and of ``kendama camera check``.

It stands beside the cameras and not on the game's floor: it needs cameras and a tracker, and knows no robot.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.devices.camera.interface import Camera, Frame, StaleFrame
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import PlaceCamera
from kendama_cli.vision.detection.interface import Sighting
from kendama_cli.vision.prediction.tracker import BallTracker

SAME_STAMP_S = 1e-6
"""A frame whose stamp is no later than this after the newest one's is that one again."""
LATE_PERIODS = 2.0
"""A time step that one camera has not seen after so many periods is used without it."""


@dataclass(frozen=True)
class ObservedImage:
    """A new frame of ``camera``, and the ball in it.

    It ``arrived_s`` and its detection was ready at ``used_s`` on the loop's clock; ``detection_s`` is the wall's time
    that finding the ball took.
    """

    camera: str
    frame: Frame
    sighting: Sighting | None
    arrived_s: float
    used_s: float
    detection_s: float


@dataclass(frozen=True)
class TimeStep:
    """Input of the tracker for one time of exposure, and its estimate of the catch pose after it."""

    t_s: float
    pose: CatchPose | None


def raise_stale(stale: StaleFrame) -> None:
    """Raise ``stale``: the reaction of a loop to a camera without a young frame, unless it is given another."""
    raise stale


class ImageLoop:
    """Loop that takes every camera's frame once, finds the ball in it, and feeds the tracker state by state.

    A time step holds what the cameras exposed together; it waits for all of them until it is late, or until free flight
    has been found: from then on each sighting counts by itself. ``now_s`` is the clock of the frames' stamps, which are
    compared with ``stamp_decimals`` (None: exactly). ``on_stale`` is called where a camera's newest frame is older than
    ``max_age_s``. Of the next frame each camera reads out the tracker's region only; every ``whole_every``-th frame (0:
    none) is a whole image. ``placed`` tells where a camera on a link is at each time.
    """

    def __init__(
        self,
        cameras: Sequence[Camera],
        tracker: BallTracker,
        *,
        now_s: Callable[[], float],
        period_s: float,
        max_age_s: float,
        stamp_decimals: int | None = None,
        on_stale: Callable[[StaleFrame], None] = raise_stale,
        placed: PlaceCamera = lambda model, _: model,
    ) -> None:
        self.cameras, self.tracker, self.period_s = cameras, tracker, period_s
        self.whole_every = 0
        self.on_stale = on_stale
        self._now_s, self._max_age_s, self._stamp_decimals = now_s, max_age_s, stamp_decimals
        self._newest_s = {camera.model.name: -np.inf for camera in cameras}
        self._waiting: dict[float, dict[str, ObservedImage]] = {}
        self._carried = {one.model.name: one.model for one in cameras if one.model.link is not None}
        self._placed = placed

    def restart(self) -> None:
        """Forget everything, as a new rollout begins: the clock was set back."""
        for camera in self.cameras:
            camera.restart()
        self.begin(-np.inf)

    def begin(self, after_s: float) -> None:
        """Begin a new flight, of which only frames after ``after_s`` count."""
        self.tracker.reset()
        self._waiting.clear()
        self._newest_s = dict.fromkeys(self._newest_s, after_s)
        if np.isfinite(after_s):
            for name in self._carried:
                self._place(name, after_s + self.period_s)

    def take(self) -> list[ObservedImage]:
        """Take every camera's frame, if it is a new one, with the ball found in it."""
        return [image for camera in self.cameras if (image := self._take(camera)) is not None]

    def feed(self, images: Sequence[ObservedImage], now_s: float, tie_m: Callable[[float], Array]) -> list[TimeStep]:
        """Feed the tracker each time step that is complete or late at ``now_s``, with the rope's tie point then."""
        tracker = self.tracker
        for image in images:
            stamp_s = image.frame.t_s
            moment_s = stamp_s if self._stamp_decimals is None else round(stamp_s, self._stamp_decimals)
            self._waiting.setdefault(moment_s, {})[image.camera] = image
        fed = []
        for moment_s in sorted(self._waiting):
            late = now_s - moment_s > LATE_PERIODS * self.period_s
            single = tracker.onset is None or tracker.found is not None
            if late or single or len(self._waiting[moment_s]) == len(self.cameras):
                together = self._waiting.pop(moment_s)
                seen = {name: image.sighting for name, image in together.items() if image.sighting is not None}
                own_s = {
                    name: float(tracker.cameras[name].exposed_s(moment_s, one.centre_px)) for name, one in seen.items()
                }
                for name, t_s in own_s.items():
                    self._place(name, t_s)
                exposed_s = moment_s + sum(t_s - moment_s for t_s in own_s.values()) / max(len(own_s), 1)
                fed.append(TimeStep(exposed_s, tracker.update(exposed_s, seen, tie_m(exposed_s), own_s)))
        return fed

    def aim(self) -> None:
        """Have every camera read out where the ball will be in its next frame, or all of it where that is due."""
        for camera in self.cameras:
            newest_s = self._newest_s[camera.model.name]
            if self.whole_every == 1 or (
                self.whole_every > 1 and round(newest_s / self.period_s + 1) % self.whole_every == 0
            ):
                camera.set_region_of_interest(None)
            else:
                self._place(camera.model.name, newest_s + self.period_s)
                camera.set_region_of_interest(self.tracker.search.region(camera.model.name, newest_s + self.period_s))

    def _place(self, name: str, t_s: float) -> None:
        """Have the tracker use a camera on a link where it is at ``t_s``."""
        if name in self._carried:
            self.tracker.cameras[name] = self._placed(self._carried[name], t_s)

    def _take(self, camera: Camera) -> ObservedImage | None:
        name = camera.model.name
        try:
            frame = camera.latest(max_age_s=self._max_age_s)
        except StaleFrame as stale:
            self.on_stale(stale)
            return None
        if frame.t_s <= self._newest_s[name] + SAME_STAMP_S:
            return None
        self._newest_s[name] = frame.t_s
        arrived_s, began_s = self._now_s(), time.perf_counter()
        self._place(name, frame.t_s)
        sighting = self.tracker.search.detect(name, frame.t_s, frame.pixels, frame.origin_px)
        return ObservedImage(name, frame, sighting, arrived_s, self._now_s(), time.perf_counter() - began_s)
