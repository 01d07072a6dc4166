"""Tracking a ball through films: the work of ``camera track``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.cli import render
from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.devices.camera.calibration import camera_model, read_calibration
from kendama_cli.errors import InputError, StageError, UsageError
from kendama_cli.plugins.films.ball_box import BallBox, TrainedImage
from kendama_cli.plugins.films.ball_film import FilmTrack, film_track
from kendama_cli.plugins.films.detect import Seeing, SeeingOptions, detector_name, open_seeing
from kendama_cli.plugins.films.draw import boxes_for_track
from kendama_cli.plugins.films.film_positions import FilmPositions, clock_offsets, from_one, from_several
from kendama_cli.plugins.films.track_output import track_table
from kendama_cli.plugins.films.track_overlay import draw_track
from kendama_cli.plugins.shared.videos.video import VideoFile, video_faults
from kendama_cli.vision.cameras.camera_model import CameraModel


@dataclass(frozen=True)
class TrackOptions:
    """Options beside the films."""

    calibration: Path | None
    ball_mm: float | None
    boxes: tuple[str, ...]
    same_clock: bool
    overlay: Path | None


def track_films(
    paths: Sequence[Path], output: Path, seeing: SeeingOptions, options: TrackOptions, *, as_json: bool
) -> None:
    """Track the ball through every film, write the track, and draw it if asked.

    Raises UsageError or InputError, with nothing written, where films, calibration and boxes do not fit together.
    """
    refuse_output(output, "a track is a CSV", ".csv")
    if options.overlay is not None:
        refuse_output(options.overlay, "it is written as WebM", ".webm", option="--overlay")
    boxes = [_box(text) for text in options.boxes]
    films = [VideoFile(path) for path in paths]
    cameras = _cameras(films, options)
    if not boxes and seeing.teach is None and seeing.detector is None:
        seeing = replace(seeing, teach=boxes_for_track(paths[0]))
    detector_name(seeing, boxes=bool(boxes))  # told before films are read
    lengths = [_checked_length(film) for film in films]
    opened = open_seeing(seeing, _shown(films[0], lengths[0], boxes))
    tracks = [_tracked(film, frames, opened) for film, frames in zip(films, lengths, strict=True)]
    tracks = [one.exposed(camera) for one, camera in zip(tracks, cameras, strict=True)] if cameras else tracks
    positions = _positions(paths, tracks, cameras, options)
    write_output(output, track_table(tracks[0], positions))
    if options.overlay is not None:
        draw_track(films[0], tracks[0], options.overlay)
    document = _document(output, tracks, positions)
    if as_json:
        render.document(document)
        return
    unit = "pixels: give --calibration for metres" if positions is None else "metres and pixels"
    render.text(f"{output}: {document['rows']} rows, in {unit}")
    if document["misfit_sigmas"] is not None:
        render.prose(
            f"the films' rays usually miss each other by {document['misfit_sigmas']:.1f} sigma (1: they agree)"
        )
    for name, offset in document["offset_s"].items():
        render.prose(f"{name}: its clock is {1e3 * offset:.1f} ms ahead of that of {films[0].name}")


def _cameras(films: Sequence[VideoFile], options: TrackOptions) -> list[CameraModel]:
    """Return the model of each film's camera, by name, or in the calibration's order; none without a calibration."""
    names = [film.name for film in films]
    if len(set(names)) < len(names):
        raise UsageError(f"two films are called {', '.join(names)}: a film has its camera's name")
    if options.calibration is None:
        if len(films) > 1:
            raise UsageError("several films give places in metres: add --calibration (see 'kendama camera calibrate')")
        return []
    entries = read_calibration(str(options.calibration))
    known = {entry.name: entry for entry in entries}
    if all(name in known for name in names):
        chosen = [known[name] for name in names]
    elif len(entries) == len(films):
        chosen = entries
    else:
        raise InputError(
            str(options.calibration),
            f"it calibrates the cameras {', '.join(known)}, not {', '.join(names)}",
            remedy="give each film the name of its camera",
        )
    if len(films) == 1 and options.ball_mm is None:
        raise UsageError("one camera sees depth by the ball's size: add --ball-mm, its diameter")
    for film, entry in zip(films, chosen, strict=True):
        if (film.width_px, film.height_px) != (entry.width_px, entry.height_px):
            turned = f", turned by {film.turned_deg}° as its metadata says" if film.turned_deg else ""
            size = f"{film.width_px} x {film.height_px} px{turned}"
            calibrated = f"{entry.width_px} x {entry.height_px} px"
            raise InputError(
                str(film.path),
                f"it has {size}, but camera '{entry.name}' was calibrated with {calibrated}",
                remedy="film and calibrate in one resolution and orientation",
            )
        if film.turned_deg and entry.readout_s:
            lines = "run upwards" if film.turned_deg == 180 else "are columns"
            raise InputError(
                str(film.path),
                f"it is turned by {film.turned_deg}° as its metadata says, so its shutter's lines {lines}",
                remedy="film with the camera level, or leave out readout_s",
            )
    return [camera_model(entry) for entry in chosen]


@dataclass(frozen=True)
class _Box:
    """Box of ``--box``, as it was written, and in numbers: a frame, and left, top, width and height [px]."""

    text: str
    frame: int
    left: float
    top: float
    width: float
    height: float


def _box(text: str) -> _Box:
    """Parse the box in ``text``, FRAME:X,Y,W,H; raises UsageError for any other."""
    frame, _, place = text.partition(":")
    try:
        left, top, width, height = (float(part) for part in place.split(","))
        box = _Box(text, int(frame), left, top, width, height)
    except ValueError:
        raise UsageError(f"--box {text}: give a frame and the box in it, such as 12:310,200,40,38") from None
    if not (width > 0 and height > 0 and np.isfinite([left, top, width, height]).all()):
        raise UsageError(f"--box {text}: width and height are more than 0 px, such as 12:310,200,40,38")
    return box


def _shown(film: VideoFile, frames: int, boxes: Sequence[_Box]) -> list[TrainedImage]:
    """Return the frames that ``boxes`` point into, of a film that has so many; raises UsageError for a box not in
    it.
    """
    wanted: dict[int, list[BallBox]] = {}
    for box in boxes:
        if not 0 <= box.frame < frames:
            raise UsageError(
                f"--box {box.text}: the film {film.path} has no frame {box.frame}; its frames are 0 to {frames - 1}"
            )
        right, bottom = box.left + box.width, box.top + box.height
        if not (box.left >= 0 and right <= film.width_px and box.top >= 0 and bottom <= film.height_px):
            raise UsageError(f"--box {box.text}: it lies outside of the film's {film.width_px} x {film.height_px} px")
        middle = box.left + box.width / 2 - 0.5, box.top + box.height / 2 - 0.5
        wanted.setdefault(box.frame, []).append(BallBox(*middle, box.width, box.height))
    shown = islice(film.frames(), max(wanted, default=-1) + 1)
    return [TrainedImage(one[1], tuple(wanted[number])) for number, one in enumerate(shown) if number in wanted]


def _checked_length(film: VideoFile) -> int:
    """Return the number of frames of a film; what is wrong with them is told."""
    times_s = film.times_s()
    for fault in video_faults(film, times_s):
        render.note(fault)
    return len(times_s)


def _tracked(film: VideoFile, frames: int, seeing: Seeing) -> FilmTrack:
    """Return the ball's track in a film of so many frames; raises StageError where no ball is found."""
    found = film_track(film.name, film.frames, seeing.detector, seeing.threshold, seeing.taught)
    if not len(found.t_s):
        raise StageError(
            f"{film.path}: no ball found: it is seen in no frame; teach it by boxes: --box FRAME:X,Y,W,H, 3 to 10 of "
            "them, in several frames"
        )
    render.note(f"{film.path}: the ball is seen in {len(found.t_s)} of {frames} frames")
    return found


def _positions(
    paths: Sequence[Path], tracks: Sequence[FilmTrack], cameras: Sequence[CameraModel], options: TrackOptions
) -> FilmPositions | None:
    if not cameras:
        return None
    if len(cameras) == 1:
        assert options.ball_mm is not None
        return from_one(tracks[0], cameras[0], options.ball_mm / 2e3)
    try:
        same = np.zeros(len(tracks) - 1) if options.same_clock else clock_offsets(tracks, cameras)
        return from_several(tracks, cameras, same)
    except ValueError as wrong:
        raise InputError(", ".join(map(str, paths)), str(wrong), remedy="look at one film with --overlay") from None


def _document(output: Path, tracks: Sequence[FilmTrack], positions: FilmPositions | None) -> dict[str, Any]:
    rows = len(tracks[0].t_s) if positions is None else len(positions.t_s)
    names = [one.name for one in tracks[1:]]
    offsets = {} if positions is None else dict(zip(names, positions.offset_s.tolist(), strict=False))
    return {
        "output": str(output),
        "rows": rows,
        "seen": {one.name: len(one.t_s) for one in tracks},
        "offset_s": offsets,
        "misfit_sigmas": None if positions is None else positions.misfit_sigmas,
    }
