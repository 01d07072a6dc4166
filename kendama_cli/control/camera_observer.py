"""Observer of games through images: tracker and estimator, on the robot's axis of time."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Sequence

import numpy as np

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.control.cup_cart import CartStep
from kendama_cli.control.flight_observer import (
    CatchPrediction,
    ObservationLog,
    ObservedFrame,
    Picture,
    predict_catch,
)
from kendama_cli.control.settings import ObservationSettings
from kendama_cli.devices.camera.image_loop import ImageLoop, ObservedImage
from kendama_cli.devices.camera.interface import StaleFrame
from kendama_cli.devices.robot.interface import Exchange
from kendama_cli.motion.sampling import columns_at
from kendama_cli.schema.arrays import Array

SEARCH_HALF_PX = 40.0
"""The swing-up knows the ball so well that the search begins this near to it."""
LOST_FRAMES = 6.0
"""After so many frames without the ball it counts as lost: the predicted catch is still pursued."""
UNDETECTED_S = 0.12
"""Free flight that is not detected so long after the goal is reported as a problem."""
FALSE_ALARM_S = 0.1
"""Free flight that the swing-up does not end with by then was none, or is over: the observation begins anew."""
KEPT_PERIODS = 16
"""Joint angles that are remembered: an image is older than the newest by a few control periods."""


class CameraClock:
    """Clock of the cameras, whose axis of time is the robot's: it is set by every answer of the robot.

    Between two answers a simulated camera's clock stands still, ``processing_s`` behind for what images need to come
    through; that of ``live`` cameras runs with the wall's.
    """

    def __init__(self, processing_s: float, *, live: bool) -> None:
        self._processing_s, self._live = processing_s, live
        self.set(0.0)

    def set(self, robot_s: float) -> None:
        """Set the time with which the robot has just answered."""
        self._robot_s, self._set_s = robot_s, time.monotonic() if self._live else 0.0

    @property
    def now_s(self) -> float:
        """Time of the robot now."""
        return self._robot_s + (time.monotonic() - self._set_s if self._live else 0.0)

    def __call__(self) -> float:
        return self.now_s if self._live else self._robot_s - self._processing_s


class CameraObserver:
    """FlightObserver through images: tracker and estimator work in the frame of the cameras, ``origin_m`` (3,) away.

    While the ball rises through the last part of the swing-up the test for free flight already runs, so that its delay
    costs nothing; the search begins where the swing-up has the ball. From the goal on nothing but images and the joint
    angles is used; ``cup_place`` gives the tie point (3,) for these. ``rim_m`` and ``catch_m`` are heights in
    the world.
    """

    tracked = False

    def __init__(
        self,
        loop: ImageLoop,
        settings: ObservationSettings,
        *,
        cup_place: Callable[[Array], Array],
        clock: CameraClock,
        rngs: Sequence[np.random.Generator],
        origin_m: Array,
        rim_m: float,
        catch_m: float,
    ) -> None:
        self.loop = loop
        self._tracker, self._settings, self._cup_place = loop.tracker, settings, cup_place
        self._clock, self._rngs = clock, rngs
        self._origin_m = np.asarray(origin_m)
        self._rim_m, self._catch_m = rim_m - float(origin_m[2]), catch_m - float(origin_m[2])
        self.begin(0, pictured=False)

    def begin(self, seed: int, *, pictured: bool) -> None:
        self.observed = ObservationLog(period_s=self.loop.period_s)
        self._pictured = pictured
        self.loop.whole_every = self._settings.image_every if pictured else 0
        self._observing = False
        self._start_s = 0.0
        self._flying_s, self._sighted_s = math.inf, -math.inf
        for number, rng in enumerate(self._rngs):
            rng.bit_generator.state = np.random.default_rng([seed, number]).bit_generator.state
        self.loop.restart()
        self._joints: list[tuple[float, Array]] = []

    def report_stale(self, stale: StaleFrame) -> None:
        """Report a camera that has no young frame; one that has only not begun yet is no problem."""
        if math.isfinite(stale.age_s):
            self._report(f"camera '{stale.camera}' delivers no more")

    def swinging(self, step: CartStep) -> None:
        self._remember(step.exchange)
        state = step.state
        near = abs(state.angle_rad) >= math.radians(self._settings.observe_from_deg)
        if near and state.angle_rad * state.rate_rad_s > 0:
            if not self._observing:
                self._begin_observing(step)
                self._tracker.search.expect(step.exchange.state.ball_in_world_m - self._origin_m, SEARCH_HALF_PX)
                self.loop.aim()
            self._observe(step)
            found = self._tracker.found
            if found is not None and step.exchange.t_s - found.declared_s > FALSE_ALARM_S:
                self._observing = False
        else:
            self._observing = False

    def flying(self, step: CartStep) -> CatchPrediction | None:
        self._remember(step.exchange)
        if math.isinf(self._flying_s):
            self._flying_s = step.exchange.t_s
        if not self._observing:  # a swing-up that ends otherwise than by rising to its goal
            self._begin_observing(step)
            self.loop.aim()
        fed = self._observe(step)
        self._report_problems(step.exchange.t_s)
        if not fed:
            return None
        now = predict_catch(self._tracker.estimator, step.t_s, rim_m=self._rim_m, catch_m=self._catch_m)
        if now is None:
            return None
        return CatchPrediction(now.t_s, self._in_world(now.rim), self._in_world(now.catch))

    def without_goal(self) -> CameraObserver:
        return self

    def _begin_observing(self, step: CartStep) -> None:
        """Begin to observe; frames from before are left."""
        self._observing = True
        self.observed.free_s = None
        self.loop.begin(step.exchange.t_s - self.loop.period_s)

    def _observe(self, step: CartStep) -> bool:
        """Take what is new; return True if the tracker was given anything."""
        exchange = step.exchange
        self._start_s = exchange.t_s - step.t_s
        self._clock.set(exchange.t_s)
        images = self.loop.take()
        for image in images:
            self._record(image)
        if not self.loop.feed(images, exchange.t_s, self._tie_m):
            return False
        if self._tracker.found is not None and self.observed.free_s is None:
            self.observed.free_s = self._tracker.found.declared_s - self._start_s
        self.loop.aim()
        return True

    def _record(self, image: ObservedImage) -> None:
        t_s, model = image.frame.t_s - self._start_s, self._tracker.cameras[image.camera]
        if image.sighting is not None:
            self._sighted_s = image.frame.t_s
        self.observed.frames.append(ObservedFrame(t_s, image.used_s - self._start_s, image.camera, image.sighting))
        if image.frame.pixels.shape[:2] == (model.height_px, model.width_px) and self._pictured:
            self.observed.pictures.append(Picture(t_s, image.camera, image.frame.pixels))

    def _remember(self, exchange: Exchange) -> None:
        self._joints.append((exchange.t_s, exchange.state.position_rad))
        del self._joints[:-KEPT_PERIODS]

    def position_rad(self, t_s: float) -> Array:
        """Return the measured joint angles (n,) at ``t_s``; after the newest ones they change on as before them."""
        if len(self._joints) > 1 and t_s > self._joints[-1][0]:
            (before_s, before), (last_s, last) = self._joints[-2:]
            return np.asarray(last + (t_s - last_s) / (last_s - before_s) * (last - before))
        times, angles = zip(*self._joints, strict=True)
        return columns_at(t_s, times, np.array(angles))

    def _tie_m(self, t_s: float) -> Array:
        return self._cup_place(self.position_rad(t_s)) - self._origin_m

    def _report_problems(self, now_s: float) -> None:
        """Report where the ball is lost, or its free flight is not detected in time."""
        if now_s - max(self._sighted_s, self._flying_s) > LOST_FRAMES * self.loop.period_s:
            self._report("the ball was lost")
        if self._tracker.lost:
            self._report("the sightings contradicted each other and were given up")
        if self.observed.free_s is None and now_s > self._flying_s + UNDETECTED_S:
            self._report("free flight was not detected in time")

    def _report(self, problem: str) -> None:
        if problem not in self.observed.problems:
            self.observed.problems.append(problem)

    def _in_world(self, pose: CatchPose) -> CatchPose:
        """Return a pose of the cameras' frame and axis of time in the world, its time from the rollout's start."""
        return dataclasses.replace(pose, t_s=pose.t_s - self._start_s, position_m=pose.position_m + self._origin_m)
