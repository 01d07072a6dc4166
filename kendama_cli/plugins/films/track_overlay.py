"""A film with the tracked ball drawn in, to look at what the detector saw."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from kendama_cli.plugins.films.ball_film import FilmTrack
from kendama_cli.plugins.shared.videos.video import VideoFile
from kendama_cli.plugins.shared.videos.video_writer import vp8_video

TRAIL_FRAMES = 12


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
