"""Tracks of everything that moves in an MCAP log: the translations of its foxglove.FrameTransform messages."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.log.reader import LogFile
from kendama_cli.vision.flight_search import RecordedTrack

SCHEMA = "foxglove.FrameTransform"


def read_mcap_tracks(path: Path) -> list[RecordedTrack]:
    """A track per topic and child frame, samples of equal time dropped; raises InputError without any."""
    log = LogFile(path, topics=())
    topics = [one["topic"] for one in log.describe()["channels"] if one["schema"] == SCHEMA and one["messages"]]
    if not topics:
        listed = ", ".join(log.topics) or "none"
        raise InputError(str(path), f"no messages of {SCHEMA}; its topics: {listed}", remedy="log the ball as one")
    log = LogFile(path, topics)  # images, say, were not worth keeping
    tracks = []
    for topic in topics:
        for child, table in log.table(topic).groupby("child", sort=True):
            t_s, first = np.unique(table["t_s"].to_numpy(np.float64), return_index=True)
            tracks.append(
                RecordedTrack(f"{topic} {child}", t_s, table[["x_m", "y_m", "z_m"]].to_numpy(np.float64)[first])
            )
    return tracks
