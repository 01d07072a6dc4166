"""One film of ``camera track``: what is wrong with it, and the ball's track in it."""

from __future__ import annotations

from itertools import islice

from kendama_cli.cli import render
from kendama_cli.devices.camera.video import VideoFile, video_faults
from kendama_cli.errors import StageError
from kendama_cli.plugins.films.ball_film import FilmTrack, film_track
from kendama_cli.plugins.films.detect import Seeing
from kendama_cli.plugins.films.self_training import FRAMES


def checked_length(film: VideoFile) -> int:
    """Return the number of frames of a film; what is wrong with them is told."""
    times_s = film.times_s()
    for fault in video_faults(film, times_s):
        render.note(fault)
    return len(times_s)


def tracked(film: VideoFile, frames: int, seeing: Seeing, *, self_training: bool) -> FilmTrack:
    """Return the ball's track in a film of so many frames; raises StageError where no ball is found."""
    detector = seeing.detector
    if self_training and seeing.trained_on is not None:
        render.note(f"{film.path}: learning on from its own frames (--no-self-training leaves that out)")
        first = max(frames - FRAMES, 0) // 2
        detector = seeing.trained_on([pixels for _, pixels in islice(film.frames(), first, first + FRAMES)])
    found = film_track(film.name, film.frames(), detector, seeing.threshold)
    if not len(found.t_s):
        raise StageError(
            f"{film.path}: no ball found: it is seen in no frame; teach it by boxes: --box FRAME:X,Y,W,H, 3 to 10 of "
            "them, in several frames"
        )
    render.note(f"{film.path}: the ball is seen in {len(found.t_s)} of {frames} frames")
    return found
