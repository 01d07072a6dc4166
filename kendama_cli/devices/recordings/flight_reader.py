"""Tracks of thrown balls: of every marker and body that a recording holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kendama_cli.devices.recordings.reader import read_bodies
from kendama_cli.errors import InputError
from kendama_cli.vision.prediction.flight_search import RecordedTrack


def read_tracks(path: Path) -> list[RecordedTrack]:
    """Return every point's track; raises InputError for an unknown or damaged file, and where time does not rise."""
    tracks = [_once(RecordedTrack(one.name, one.t_s, one.position_m)) for one in read_bodies(str(path))]
    for track in tracks:
        wrong = np.flatnonzero(~(np.diff(track.t_s) > 0))
        if len(wrong):
            i = int(wrong[0])
            problem = f"time does not rise: {track.t_s[i + 1]:.6g} s after {track.t_s[i]:.6g} s"
            remedy = "sort the samples, drop repeated ones, and give every one a time"
            raise InputError(str(path), problem, where=f"sample {i + 2} of '{track.name}'", remedy=remedy)
    return tracks


def _once(track: RecordedTrack) -> RecordedTrack:
    """Remove samples that repeat the one before to the digit, time and all."""
    table = np.column_stack([track.t_s, track.position_m])
    same = (table[1:] == table[:-1]) | (np.isnan(table[1:]) & np.isnan(table[:-1]))
    new = np.concatenate([[True], ~same.all(axis=1)])[: len(table)]
    return RecordedTrack(track.name, track.t_s[new], track.position_m[new])
