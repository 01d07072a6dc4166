"""Tracks of thrown balls: of every marker and body that a recording holds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.plugins.shared.recordings.reader import read_bodies
from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class RecordedTrack:
    """One recorded point: times ``t_s`` (n,), rising, and ``position_m`` (n, 3), nan where it was not seen.

    So many samples were left out as ``repeated``: they had the time of the one before.
    """

    name: str
    t_s: Array
    position_m: Array
    repeated: int = 0


def read_tracks(path: Path) -> list[RecordedTrack]:
    """Return every point's track; raises InputError for an unknown or damaged file, and where time does not rise."""
    tracks = [_once(RecordedTrack(one.name, one.t_s, one.position_m)) for one in read_bodies(str(path))]
    for track in tracks:
        wrong = np.flatnonzero(~(np.diff(track.t_s) > 0))
        if len(wrong):
            i = int(wrong[0])
            problem = f"time does not rise: {track.t_s[i + 1]:.6g} s after {track.t_s[i]:.6g} s"
            remedy = "sort the samples, and give every one a time"
            raise InputError(str(path), problem, where=f"sample {i + 2} of '{track.name}'", remedy=remedy)
    return tracks


def _once(track: RecordedTrack) -> RecordedTrack:
    """Remove samples that have the time of the one before."""
    new = np.concatenate([[True], np.diff(track.t_s) != 0])[: len(track.t_s)]
    return RecordedTrack(track.name, track.t_s[new], track.position_m[new], int((~new).sum()))
