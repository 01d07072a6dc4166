"""Tracking a ball through films: the work of ``camera track``."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import cv2
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
from kendama_cli.plugins.shared.videos.video import VideoFile, video_faults
from kendama_cli.plugins.shared.videos.video_writer import vp8_video
from kendama_cli.vision.cameras.camera_model import CameraModel

METRES = ("x_m", "y_m", "z_m", "sigma_x_m", "sigma_y_m", "sigma_z_m")
PIXELS = ("frame", "u_px", "v_px", "sigma_px", "radius_px", "score")
TRAIL_FRAMES = 12


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


def track_table(first: FilmTrack, positions: FilmPositions | None) -> bytes:
    """Return the CSV: times of the first film [s], metres if they are known, then the first film's pixels."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("t_s", *(() if positions is None else METRES), *PIXELS))
    for i, t_s in enumerate(first.t_s):
        metres: list[str] = []
        if positions is not None:
            at = int(np.searchsorted(positions.t_s, t_s))
            if at == len(positions.t_s) or positions.t_s[at] != t_s:
                continue
            sigma = np.sqrt(np.diagonal(positions.covariance_m2[at]))
            metres = [f"{value:.6f}" for value in (*positions.position_m[at], *sigma)]
        sigma_px = np.sqrt(np.trace(first.covariance_px2[i]) / 2)
        cells = (f"{value:.3f}" for value in (*first.centre_px[i], sigma_px, first.radius_px[i], first.score[i]))
        rows.writerow((f"{t_s:.6f}", *metres, int(first.frame[i]), *cells))
    return text.getvalue().encode()


def draw_track(film: VideoFile, found: FilmTrack, output: Path) -> None:
    """Write ``film`` with the ball and its last places as ``found`` drawn in; raises InputError where it cannot."""
    rate_hz = 30.0
    if len(found.t_s) > 1:
        rate_hz = float(np.clip(1 / np.median(np.diff(found.t_s) / np.diff(found.frame)), 1, 240))
    at = {int(frame): i for i, frame in enumerate(found.frame)}
    with vp8_video(output, rate_hz, film.width_px, film.height_px) as write:
        for number, (_, pixels) in enumerate(film.frames()):
            drawn = pixels.copy()
            i = at.get(number)
            if i is not None:
                u, v = (round(float(value)) for value in found.centre_px[i])
                cv2.circle(drawn, (u, v), max(round(float(found.radius_px[i])), 2), (60, 60, 230), 2, cv2.LINE_AA)
            trail = [j for j in (at.get(number - back) for back in range(TRAIL_FRAMES)) if j is not None]
            if len(trail) > 1:
                cv2.polylines(
                    drawn, [np.rint(found.centre_px[trail]).astype(np.int32)], False, (80, 200, 80), 2, cv2.LINE_AA
                )
            write(drawn)
