"""One film of ``camera track``: what is wrong with it, and the ball's track in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from kendama_cli.cli import render
from kendama_cli.cli.camera_seeing import Seeing, tell_shift
from kendama_cli.devices.camera.film import Film
from kendama_cli.devices.camera.film_check import film_faults
from kendama_cli.errors import StageError
from kendama_cli.vision.ball_film import FilmTrack, film_track
from kendama_cli.vision.camera_shift import CameraShift, camera_shift
from kendama_cli.vision.interface import Detector, Image
from kendama_cli.vision.motion_detector import MotionDetector
from kendama_cli.vision.self_training import FRAMES

TEACH = "teach the ball by boxes: --box FRAME:X,Y,W,H, 3 to 10 of them"
SPREAD_FRAMES = 41
"""Of a film, evenly spread: its background, and whether its camera stood still."""


def checked_length(film: Film) -> int:
    """Return the number of frames of a video; report what is wrong with them."""
    times_s = film.times_s()
    for fault in film_faults(film, times_s):
        render.note(fault)
    return len(times_s)


def tracked(film: Film, frames: int, opened: Seeing, *, calibrated: bool, self_training: bool) -> FilmTrack:
    """Return the ball's track in a film of so many frames.

    A film that is ``calibrated`` gives metres, for which its camera must stand still: where it did not, that is told,
    and centres are known as much less well as the scene is off. Raises StageError where no ball is found.
    """
    detector = opened.detector
    times_s, shift = np.zeros(0), CameraShift(np.zeros(0))
    if calibrated or isinstance(detector, MotionDetector):
        spread = list(film.frames(max(frames // SPREAD_FRAMES, 1)))
        images = [pixels for _, pixels in spread]
        times_s, shift = np.array([t_s for t_s, _ in spread]), camera_shift(images)
        tell_shift(str(film.path), shift, by_motion=isinstance(detector, MotionDetector), calibrated=calibrated)
        if isinstance(detector, MotionDetector):
            detector.learn(images)
    if self_training and opened.trained_on is not None:
        render.note(f"{film.path}: learning on from its own frames (--no-self-training leaves that out)")
        detector = opened.trained_on(_middle(film, frames))
    found = film_track(film.name, film.frames(), detector, opened.threshold)
    _refuse_no_ball(film, found, detector)
    render.note(f"{film.path}: the ball is seen in {len(found.t_s)} of {frames} frames")
    if not calibrated or shift.stood:
        return found
    off_px2 = shift.at(times_s, found.t_s)[:, None, None] ** 2
    return replace(found, covariance_px2=found.covariance_px2 + off_px2 * np.eye(2))


def _refuse_no_ball(film: Film, found: FilmTrack, detector: Detector) -> None:
    """Raise StageError for a film without sightings, or in which what moves is none: nobody has shown it the ball."""
    seen, smallest_px = found.evidence(), detector.min_radius_px if isinstance(detector, MotionDetector) else 0.0
    if not seen.rows:
        raise StageError(f"{film.path}: no ball found: it is seen in no frame; {TEACH}")
    if smallest_px and not seen.is_ball(smallest_px):
        raise StageError(
            f"{film.path}: no ball found: what moves in {seen.rows} frames has a radius of {seen.radius_px:.1f} px "
            f"(of {smallest_px:g} px at least), the longest smooth stretch has {seen.longest} frames, and "
            f"{seen.smooth_share:.0%} of the rows are on smooth arcs; {TEACH}"
        )


def _middle(film: Film, count: int) -> Sequence[Image]:
    """Return the frames in the centre of a video from which its ball is learned."""
    first = max(count - FRAMES, 0) // 2
    return [pixels for _, pixels in islice(film.frames(), first, first + FRAMES)]
