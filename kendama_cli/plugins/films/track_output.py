"""The file that ``camera track`` writes: a CSV with a row per moment, or an MCAP log of the same."""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.log.writer import McapLog, MemoryFile
from kendama_cli.plugins.films.ball_film import FilmTrack
from kendama_cli.plugins.films.film_positions import FilmPositions
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import FrameTransform

METRES = ("x_m", "y_m", "z_m", "sigma_x_m", "sigma_y_m", "sigma_z_m")
PIXELS = ("frame", "u_px", "v_px", "sigma_px", "radius_px", "score")


@dataclass(frozen=True)
class SightingMessage:
    """Place of the ball in one frame of a video, with its centre's standard deviation and the detector's score."""

    film: str
    frame: int
    u_px: float
    v_px: float
    sigma_px: float
    radius_px: float
    score: float


@dataclass(frozen=True)
class PlaceMessage:
    """Position of the ball [m], with its covariance (9,) [m^2], row by row."""

    x_m: float
    y_m: float
    z_m: float
    covariance_m2: Collection[float]


TOPICS = {
    "/track/sighting": SightingMessage,
    "/track/ball": FrameTransform,
    "/track/place": PlaceMessage,
}


def refuse_track(output: Path) -> None:
    """Raise UsageError for a file that cannot be written, or whose name says neither CSV nor MCAP."""
    refuse_output(output, "a track is a CSV or an MCAP log", ".csv", ".mcap")


def write_track(output: Path, tracks: Sequence[FilmTrack], positions: FilmPositions | None) -> None:
    """Write the track to ``output``; times are the first film's [s]. Raises StoreError where the disk refuses."""
    data = _log(tracks, positions) if output.suffix.lower() == ".mcap" else _table(tracks[0], positions)
    write_output(output, data)


def _table(first: FilmTrack, positions: FilmPositions | None) -> bytes:
    """Return a row per frame: metres first if they are known, then the first video's pixels."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    head = (() if positions is None else METRES, PIXELS)
    rows.writerow(("t_s", *(name for names in head for name in names)))
    for i, t_s in enumerate(first.t_s):
        metres: list[str] = []
        if positions is not None:
            at = int(np.searchsorted(positions.t_s, t_s))
            if at == len(positions.t_s) or positions.t_s[at] != t_s:
                continue
            sigma = np.sqrt(np.diagonal(positions.covariance_m2[at]))
            metres = [f"{value:.6f}" for value in (*positions.position_m[at], *sigma)]
        seen = _sighting(first, i)
        pixels = (seen.u_px, seen.v_px, seen.sigma_px, seen.radius_px, seen.score)
        cells = (f"{value:.3f}" for value in pixels)
        rows.writerow((f"{t_s:.6f}", *metres, seen.frame, *cells))
    return text.getvalue().encode()


def _log(tracks: Sequence[FilmTrack], positions: FilmPositions | None) -> bytes:
    """Return all detections, with every video's own clock converted to the first's, and the positions that are
    known.
    """
    log = McapLog(TOPICS, MemoryFile())
    offsets = [0.0, *(np.zeros(len(tracks) - 1) if positions is None else positions.offset_s)]
    ahead = zip(tracks, offsets, strict=True)
    shown = [(t_s - offset_s, track, i) for track, offset_s in ahead for i, t_s in enumerate(track.t_s)]
    for t_s, track, i in sorted(shown, key=lambda one: one[0]):
        log.write("/track/sighting", max(float(t_s), 0.0), _sighting(track, i))
    for t_s, position_m, covariance_m2 in _places(positions):
        log.write("/track/ball", t_s, FrameTransform("world", "ball", position_m))
        x_m, y_m, z_m = (float(value) for value in position_m)
        log.write("/track/place", t_s, PlaceMessage(x_m, y_m, z_m, covariance_m2.ravel()))
    with TemporaryDirectory() as folder:
        path = Path(folder, "track.mcap")
        log.finish(path, stage="track", settings={}, metrics={})
        return path.read_bytes()


def _places(positions: FilmPositions | None) -> Iterator[tuple[float, Array, Array]]:
    if positions is not None:
        for t_s, position_m, covariance_m2 in zip(
            positions.t_s, positions.position_m, positions.covariance_m2, strict=True
        ):
            yield float(t_s), position_m, covariance_m2


def _sighting(track: FilmTrack, i: int) -> SightingMessage:
    u_px, v_px = (float(value) for value in track.centre_px[i])
    sigma_px = float(np.sqrt(np.trace(track.covariance_px2[i]) / 2))
    radius_px, score = float(track.radius_px[i]), float(track.score[i])
    return SightingMessage(track.name, int(track.frame[i]), u_px, v_px, sigma_px, radius_px, score)
