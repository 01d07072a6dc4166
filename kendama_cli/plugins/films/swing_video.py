"""Demonstrations out of a video of a swing: ball and cup by boxes, scale by the string, vertical by gravity."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from kendama_cli.devices.demonstrator.file import RecordedDemonstrator, hands_of
from kendama_cli.devices.demonstrator.live_figures import Tell, silent
from kendama_cli.devices.demonstrator.recording import MIN_SAMPLES, Recording
from kendama_cli.devices.demonstrator.segments import checked_swings
from kendama_cli.errors import InputError
from kendama_cli.plugins.films.ball_box import FEWEST_BOXES
from kendama_cli.plugins.films.box_follower import BoxFollower, BoxTrack
from kendama_cli.plugins.films.boxes import labelled, read_labelled
from kendama_cli.plugins.films.swing_boxes import swing_boxes
from kendama_cli.plugins.films.swing_plane import SwingPlane, SwingSight, swing_plane
from kendama_cli.plugins.films.swing_settings import SwingVideoCapture
from kendama_cli.plugins.shared.videos.video import VideoFile, shown_otherwise, video_faults
from kendama_cli.schema.arrays import Array

DOUBTFUL_SHARE = 0.9
SHORTEST_S = 0.5
"""Shorter stretches between gaps hold no swing."""
SEED = 0
UNSEEN = (
    "a video shows neither depth nor turn: the swing is taken in a plane square to the view, the cup as upright; seen "
    "from 10 deg aside it is 1.5 % narrower, from 20 deg 6 %"
)


def open_swing_videos(settings: SwingVideoCapture, tell: Tell = silent) -> Sequence[RecordedDemonstrator]:
    """Open a demonstrator for every swing in the videos; ``tell`` receives the images that were read of each.

    Raises InputError where ball or cup cannot be followed.
    """
    paths = (settings.path,) if isinstance(settings.path, str) else settings.path or ()
    found: list[Recording] = []
    for film in (VideoFile(Path(path)) for path in paths):
        t_s, tracks = followed(film, settings.rate_hz, tell)
        as_shown = set(shown_otherwise(film))
        faults = [one for one in video_faults(film, t_s) if one not in as_shown]
        found += swings(film.path, t_s, tracks, settings, faults)
    return hands_of(found)


def followed(film: VideoFile, rate_hz: float | None, tell: Tell = silent) -> tuple[Array, dict[str, BoxTrack]]:
    """Return the times (n,) [s] of a video's images, and the tracks of its ball and cup.

    Raises InputError where the boxes beside the video teach nothing.
    """
    total = film.expected or None
    tell(0, total)
    followers = {thing: _follower(folder, thing) for thing, folder in swing_boxes(film.path).items()}
    times: list[float] = []
    for t_s, pixels in film.frames():
        times.append(t_s if rate_hz is None else len(times) / rate_hz)
        for one in followers.values():
            one.see(pixels)
        tell(len(times), total)
    return np.array(times), {thing: one.track() for thing, one in followers.items()}


def _follower(folder: Path, thing: str) -> BoxFollower:
    images = [read_labelled(one) for one in labelled(folder)]
    boxes = sum(len(image.boxes) for image in images)
    try:
        if boxes < FEWEST_BOXES:
            raise ValueError(f"{boxes} boxes show the {thing}; {FEWEST_BOXES} are the least")
        return BoxFollower(images, SEED, pictures=thing == "cup")
    except ValueError as wrong:
        raise InputError(str(folder), str(wrong), remedy=f"draw each box close about the {thing}") from None


def swings(
    path: Path, t_s: Array, tracks: Mapping[str, BoxTrack], settings: SwingVideoCapture, faults: Sequence[str]
) -> list[Recording]:
    """Return the swings of a video whose images were taken at ``t_s`` (n,) [s]; ``faults`` are told with them.

    Raises InputError where ball or cup are seen too rarely, or nothing tells the scale.
    """
    for thing, seen in tracks.items():
        if len(seen.frames) < MIN_SAMPLES:
            raise InputError(
                str(path),
                f"its {thing} is seen in {len(seen.frames)} of {len(t_s)} images; at least {MIN_SAMPLES} are needed",
                remedy=f"draw more boxes: kendama camera train {shlex.quote(str(path))} --cup",
            )
    plane, cup = _plane(path, t_s, tracks, settings), tracks["cup"]
    u, v = plane.down
    x, z = (cup.places_px @ np.array([(v, -u), (-u, -v)]) / plane.px_per_m).T
    seen_s, tie_m = t_s[cup.frames], np.column_stack([x, np.zeros(len(x)), z - settings.tie_m])
    notes = [*faults, *(f"{path.name}: {one}" for one in (*plane.notes, UNSEEN))]
    share = len(seen_s) / (cup.frames[-1] - cup.frames[0] + 1)
    if share < DOUBTFUL_SHARE:
        notes.append(f"{path.name}: the cup is seen in {share:.0%} of the images only")
    found: list[Recording] = []
    for first, last in _pieces(seen_s, settings.max_gap_s):
        piece = _recording(path, t_s, seen_s[first:last], tie_m[first:last], () if found else tuple(notes))
        found += checked_swings(piece, settings.plausible, math.inf, settings.segments)
    if not found:
        raise InputError(
            str(path),
            f"its cup is never followed for {SHORTEST_S:g} s without a gap of {settings.max_gap_s:g} s",
            remedy="draw boxes where it is lost, or raise capture.max_gap_s",
        )
    return found


def _plane(path: Path, t_s: Array, tracks: Mapping[str, BoxTrack], settings: SwingVideoCapture) -> SwingPlane:
    ball, cup = tracks["ball"], tracks["cup"]
    both, at_ball, at_cup = np.intersect1d(ball.frames, cup.frames, return_indices=True)
    sight = SwingSight(t_s[both], cup.places_px[at_cup], ball.places_px[at_ball], cup.radius_px, ball.radius_px)
    try:
        if len(both) < MIN_SAMPLES:
            raise ValueError(f"ball and cup are seen together in {len(both)} images; {MIN_SAMPLES} are the least")
        return swing_plane(sight, settings.string_m, settings.tie_m)
    except ValueError as wrong:
        remedy = "give the string's length (capture.string_m), look at capture.rate_hz, or draw more boxes"
        raise InputError(str(path), str(wrong), remedy=remedy) from None


def _pieces(seen_s: Array, max_gap_s: float) -> list[tuple[int, int]]:
    """Return first and last + 1 of the stretches without a longer gap that may hold a swing."""
    cuts = [0, *(np.flatnonzero(np.diff(seen_s) > max_gap_s) + 1).tolist(), len(seen_s)]
    return [(a, b) for a, b in pairwise(cuts) if b - a >= MIN_SAMPLES and seen_s[b - 1] - seen_s[a] >= SHORTEST_S]


def _recording(path: Path, t_s: Array, seen_s: Array, place_m: Array, warnings: tuple[str, ...]) -> Recording:
    """Return the cup at every image of a stretch; where it was not seen, between its neighbours."""
    all_s = t_s[(t_s >= seen_s[0]) & (t_s <= seen_s[-1])]
    filled = np.column_stack([np.interp(all_s, seen_s, one) for one in (place_m - place_m[0]).T])
    return Recording(
        str(path),
        path.stem,
        all_s - all_s[0],
        filled,
        lambda sample: f"image at {all_s[sample]:.3f} s",
        "look at capture.string_m, capture.tie_m and capture.rate_hz",
        "turn the video upright, and look across the swing",
        warnings=warnings,
    )
