"""A hand that is seen: a printed marker on the cup's handle, in films."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kendama_cli.devices.camera.calibration import camera_model, read_calibration
from kendama_cli.devices.demonstrator.file import RecordedDemonstrator, hands_of
from kendama_cli.devices.demonstrator.live_figures import Tell, silent
from kendama_cli.devices.demonstrator.recording import Recording
from kendama_cli.devices.demonstrator.segments import checked_swings
from kendama_cli.errors import ConfigError, InputError
from kendama_cli.motion.rotation import exponential, inverse, log_of, multiply, rotated
from kendama_cli.plugins.marker.detection import MarkerDetector
from kendama_cli.plugins.marker.pose import PoseCandidate, marker_poses
from kendama_cli.plugins.marker.pose_track import PoseTrack, smooth
from kendama_cli.plugins.marker.settings import MarkerCapture, MarkerSettings
from kendama_cli.plugins.shared.videos.video import VideoFile
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel

LEVEL = np.array([(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)])
"""World to camera of a level one that looks along y: x right, z up."""
USUAL_FIELD_DEG = 65.0
"""Field of view of a phone's main camera along the longer side of a video. Lengths across the view rest on the marker's
side alone: 55 or 75 in its place change them by 0.1 %."""
FEWEST_SEEN = 10
TURNS_RAD = 0.1
"""A cup that turns by more needs the place of its tie point."""
DOUBTFUL_SHARE = 0.9


def open_marker(settings: MarkerCapture, tell: Tell = silent) -> Sequence[RecordedDemonstrator]:
    """Open a demonstrator for every swing in the films; raises InputError if the marker of one cannot be followed."""
    return films_of((settings.path,) if isinstance(settings.path, str) else settings.path or (), settings, tell)


def films_of(paths: Sequence[str], settings: MarkerSettings, tell: Tell) -> Sequence[RecordedDemonstrator]:
    """Return a demonstrator for every swing in the films; ``tell`` receives the images that were read of each."""
    recordings: list[Recording] = []
    for path in paths:
        recordings += checked_swings(_followed(path, settings, tell), settings.plausible, math.inf, settings.segments)
    return hands_of(recordings)


def _followed(path: str, settings: MarkerSettings, tell: Tell = silent) -> Recording:
    """Follow the cup's motion in the film ``path``."""
    camera: CameraModel | None = None
    detector = MarkerDetector(settings.dictionary, settings.number)
    stamps: list[float] = []
    frames: list[list[PoseCandidate]] = []
    last = None
    for stamp_s, pixels in _frames(path, settings.rate_hz):
        if camera is None:
            camera = _camera(settings, pixels.shape[1], pixels.shape[0], path)
        seen = detector.find(pixels, last)
        last = seen or last
        stamps.append(stamp_s)
        tell(len(stamps), None)
        frames.append([] if seen is None else marker_poses(seen, settings.size_m, camera))
    known = [i for i, candidates in enumerate(frames) if candidates]
    if camera is None or len(known) < FEWEST_SEEN:
        raise InputError(
            path,
            f"marker {settings.number} of {settings.dictionary} is seen in {len(known)} of {len(frames)} frames",
            remedy="look at capture.dictionary and capture.number; the print needs its white edge, and light",
        )
    t_s = np.array(stamps[known[0] : known[-1] + 1])
    _check_gaps(path, t_s, [i - known[0] for i in known], settings.max_gap_s)
    track = smooth(t_s, frames[known[0] : known[-1] + 1])
    return _recording(path, settings, camera, t_s, track)


def _recording(path: str, settings: MarkerSettings, camera: CameraModel, t_s: Array, track: PoseTrack) -> Recording:
    to_world = camera.world_to_camera.T
    offset = np.asarray(settings.marker_to_cup_m)
    turned = multiply(exponential(log_of(to_world)), track.rotation_wxyz)
    place_m = track.place_m @ to_world.T + camera.position_in_world_m + rotated(turned, offset)
    rotation = multiply(turned, inverse(turned[0]))
    largest_rad = 2 * math.acos(min(float(np.abs(rotation[:, 0]).min()), 1.0))
    sigma_mm = 1e3 * np.sqrt(np.mean(track.place_sigma_m**2, axis=0))
    share = float(track.seen.mean())
    notes = [
        f"{Path(path).name}: lengths rest on the marker's side, capture.size_m = {settings.size_m:g} m; places have a "
        f"noise of about {sigma_mm[:2].max():.1f} mm across the view and {sigma_mm[2]:.1f} mm along it, to which lens "
        "and blur add"
    ]
    if share < DOUBTFUL_SHARE:
        notes.append(
            f"{Path(path).name}: the marker is seen in {share:.0%} of the frames only; the rest is interpolated"
        )
    if not offset.any() and largest_rad > TURNS_RAD:
        notes.append(
            f"{Path(path).name}: the marker turns by {math.degrees(largest_rad):.0f} deg, which moves a tie point that "
            f"is 10 mm beside it by {20 * math.sin(largest_rad / 2):.1f} mm; measure capture.marker_to_cup_m"
        )
    return Recording(
        path,
        Path(path).stem,
        t_s - t_s[0],
        place_m,
        lambda sample: f"frame at {t_s[sample]:.3f} s",
        "look at capture.size_m (the side of the black square), capture.field_of_view_deg or capture.calibration",
        "the camera stands level and looks across the swing (capture.view); turn the film upright",
        warnings=tuple(notes),
        rotation_wxyz=rotation,
    )


def _check_gaps(path: str, t_s: Array, seen: list[int], longest_s: float) -> None:
    gaps = np.diff(t_s[seen])
    worst = int(gaps.argmax())
    if gaps[worst] > longest_s:
        raise InputError(
            path,
            f"the marker is not seen for {gaps[worst]:.2f} s; allowed: {longest_s:g} s",
            where=f"frame at {t_s[seen[worst]]:.2f} s",
            remedy="keep it in the picture and unblurred (more light, shorter exposure), cut the film, or raise "
            "capture.max_gap_s",
        )


def _frames(path: str, rate_hz: float | None) -> Iterator[tuple[float, NDArray[np.uint8]]]:
    """Yield stamps and images; without a declared rate, by the film's own stamps (they may be uneven) or rate."""
    if not Path(path).is_file():
        raise InputError(path, "no such file", remedy="set capture.path to a film, a glob or a list of them")
    film, count = VideoFile(Path(path)), 0
    if rate_hz is None and not (math.isfinite(film.rate_hz) and film.rate_hz > 0):
        raise InputError(path, "the video does not state its frame rate", remedy="set capture.rate_hz")
    for t_s, pixels in film.frames():
        yield t_s if rate_hz is None else count / rate_hz, pixels
        count += 1
    if count < 0.9 * film.expected - 2:
        raise InputError(
            path,
            f"it can be read up to frame {count} of {film.expected}; it is damaged or was cut short",
            remedy="record it again, or convert the part that can be read",
        )


def _camera(settings: MarkerSettings, width: int, height: int, path: str) -> CameraModel:
    if settings.calibration is None:
        field_deg = settings.field_of_view_deg
        side = max(width, height) if field_deg is None else width
        focal = side / 2 / math.tan(math.radians(field_deg or USUAL_FIELD_DEG) / 2)
        centre = np.array([(width - 1) / 2, (height - 1) / 2])
        return CameraModel("film", width, height, np.full(2, focal), centre, np.zeros(5), LEVEL, np.zeros(3))
    known = {one.name: one for one in read_calibration(settings.calibration)}
    name = settings.camera or next(iter(known))
    if name not in known or (settings.camera is None and len(known) > 1):
        raise ConfigError("capture.camera", f"'capture.camera' is {settings.camera}; allowed: {', '.join(known)}")
    model = camera_model(known[name])
    if (model.width_px, model.height_px) != (width, height):
        raise InputError(
            path,
            f"its images are {width} x {height} px, camera '{name}' is calibrated for "
            f"{model.width_px} x {model.height_px} px",
            remedy="calibrate for this size, or film in the calibrated one",
        )
    if settings.view == "calibration":
        return model
    return dataclasses.replace(model, world_to_camera=LEVEL, position_in_world_m=np.zeros(3))
