"""The loop that takes images, with cameras and a tracker of which everything is known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from kendama_cli.devices.camera.image_loop import ImageLoop
from kendama_cli.devices.camera.interface import Camera, Frame, StaleFrame
from kendama_cli.vision.cameras.camera_model import CameraModel, looking_at
from kendama_cli.vision.prediction.tracker import BallTracker

PERIOD_S = 0.01
ROW_S = 1e-4


class ScriptedCamera:
    """Shows the frames of ``stamps_s``, one for each call; None: it has no young frame."""

    def __init__(self, name: str, stamps_s: list[float | None]) -> None:
        self.model = seeing(name)
        self._stamps_s, self.regions, self.restarts = list(stamps_s), list[Any](), 0

    def latest(self, *, max_age_s: float) -> Frame:
        stamp_s = self._stamps_s.pop(0)
        if stamp_s is None:
            raise StaleFrame(self.model.name, 1.0, "no young frame")
        return Frame(stamp_s, np.zeros((30, 40, 3), dtype=np.uint8), (0, 0))

    def set_region_of_interest(self, region: Any) -> None:
        self.regions.append(region)

    def restart(self) -> None:
        self.restarts += 1


def seeing(name: str) -> CameraModel:
    size, level = (40, 30), looking_at((0, -1, 0), (0, 0, 0))
    focal, centre, bare = np.full(2, 40.0), np.array([19.5, 14.5]), np.zeros(5)
    return CameraModel(name, *size, focal, centre, bare, level, np.array([0.0, -1.0, 0.0]), readout_s=30 * ROW_S)


class ScriptedTracker:
    """Finds the ball 10 (left) or 12 rows (right) under every image's middle row, and writes down what it is given."""

    def __init__(self, *, onset: bool = True) -> None:
        self.search = self
        self.cameras = {name: seeing(name) for name in ("left", "right")}
        self.onset = object() if onset else None
        self.found: object | None = None
        self.given: list[tuple[float, set[str], Any]] = []
        self.own_s: list[dict[str, float]] = []

    def reset(self) -> None:
        self.given.clear()

    def detect(self, camera: str, t_s: float, pixels: Any, origin_px: Any) -> Any:
        return SimpleNamespace(centre_px=np.array([20.0, 24.5 if camera == "left" else 26.5]))

    def update(self, t_s: float, sightings: dict[str, Any], tie_m: Any, own_s: dict[str, float]) -> None:
        self.given.append((t_s, set(sightings), tie_m))
        self.own_s.append(own_s)

    def region(self, camera: str, t_s: float) -> str:
        return f"{camera} at {t_s:.3f}"


def loop(tracker: ScriptedTracker, *cameras: ScriptedCamera, **options: Any) -> ImageLoop:
    made = ImageLoop(
        [cast(Camera, camera) for camera in cameras],
        cast(BallTracker, tracker),
        now_s=lambda: 0.0,
        period_s=PERIOD_S,
        max_age_s=1.0,
        **options,
    )
    made.begin(-np.inf)
    return made


def tie_m(t_s: float) -> Any:
    return np.array([t_s, 0.0, 0.0])


def test_a_frame_that_is_shown_again_is_taken_once() -> None:
    looping = loop(ScriptedTracker(), ScriptedCamera("left", [0.01, 0.01, 0.02]))
    assert [len(looping.take()) for _ in range(3)] == [1, 0, 1]


def test_a_time_step_waits_for_the_other_camera_and_counts_at_the_time_of_the_balls_row() -> None:
    tracker = ScriptedTracker()
    looping = loop(tracker, ScriptedCamera("left", [0.01, 0.01]), ScriptedCamera("right", [0.0, 0.01]))
    looping.feed(looping.take(), 0.012, tie_m)
    assert tracker.given == []
    looping.feed(looping.take(), 0.016, tie_m)
    (t_s, cameras, tie), *_ = tracker.given
    assert cameras == {"left", "right"}
    assert t_s == pytest.approx(0.01 + 11 * ROW_S)
    assert tracker.own_s == [pytest.approx({"left": 0.01 + 10 * ROW_S, "right": 0.01 + 12 * ROW_S})]
    assert tie == pytest.approx([t_s, 0.0, 0.0])


def test_a_time_step_that_one_camera_has_missed_is_used_without_it_once_it_is_late() -> None:
    tracker = ScriptedTracker()
    looping = loop(tracker, ScriptedCamera("left", [0.01]), ScriptedCamera("right", [0.0]))
    images = looping.take()
    assert not looping.feed(images, 0.01 + 2 * PERIOD_S - 1e-9, tie_m) or tracker.given[0][1] == {"right"}
    looping.feed([], 0.01 + 2 * PERIOD_S + 1e-9, tie_m)
    assert [names for _, names, _ in tracker.given] == [{"right"}, {"left"}]


@pytest.mark.parametrize("known", ["found", "given"])
def test_once_flight_is_known_every_sighting_counts_by_itself(known: str) -> None:
    tracker = ScriptedTracker(onset=known == "found")
    tracker.found = object() if known == "found" else None
    looping = loop(tracker, ScriptedCamera("left", [0.01]), ScriptedCamera("right", [0.014]))
    looping.feed(looping.take(), 0.014, tie_m)
    assert [names for _, names, _ in tracker.given] == [{"left"}, {"right"}]


@pytest.mark.parametrize(("decimals", "moments"), [(None, 0), (6, 1)])
def test_stamps_agree_as_exactly_as_asked(decimals: int | None, moments: int) -> None:
    tracker = ScriptedTracker()
    cameras = ScriptedCamera("left", [0.01]), ScriptedCamera("right", [0.01 + 1e-9])
    looping = loop(tracker, *cameras, stamp_decimals=decimals)
    assert len(looping.feed(looping.take(), 0.01, tie_m)) == moments


def test_the_next_frame_shows_the_balls_region_or_all_where_that_is_due() -> None:
    camera = ScriptedCamera("left", [])
    looping = loop(ScriptedTracker(), camera)
    looping.whole_every = 3
    for number in range(4):
        looping.begin((number - 1) * PERIOD_S)
        looping.aim()
    assert camera.regions == [None, "left at 0.010", "left at 0.020", None]


def test_a_camera_without_a_young_frame_is_an_error_unless_something_is_done_about_it() -> None:
    with pytest.raises(StaleFrame, match="no young frame"):
        loop(ScriptedTracker(), ScriptedCamera("left", [None])).take()
    late: list[str] = []
    looping = loop(
        ScriptedTracker(),
        ScriptedCamera("left", [None]),
        ScriptedCamera("right", [0.01]),
        on_stale=lambda stale: late.append(stale.camera),
    )
    assert [image.camera for image in looping.take()] == ["right"]
    assert late == ["left"]
