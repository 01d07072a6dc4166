"""Motion capture of the cup, live: the stream is kept as it comes, and then read as a recording."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from kendama_cli.devices.hand.body import read_bodies, recording_of
from kendama_cli.devices.hand.file import RecordedHand, hands_of
from kendama_cli.devices.hand.segments import checked_swings
from kendama_cli.devices.hand.settings import MocapCapture
from kendama_cli.devices.hand.tracks.openigtlink_stream import transforms
from kendama_cli.devices.hand.tracks.stream_file import StreamFile
from kendama_cli.errors import HardwareError

FEWEST = 20
CLOCK_SHARE = 0.02
"""Stamps that run so much faster or slower than our clock are warned of."""


def open_mocap(settings: MocapCapture) -> Sequence[RecordedHand]:
    """A hand for every swing in the stream of ``settings.seconds``.

    Raises HardwareError where the server is not there, goes away or does not have the body; what came is kept.
    """
    path = Path(settings.record)
    notes = _recorded(settings, path)
    (body,) = read_bodies(str(path))
    recording = replace(recording_of(str(path), body, None, settings), warnings=notes)
    return hands_of(checked_swings(recording, settings.plausible, math.inf, settings.segments))


class _Stream:
    """What came: the body's stamps and when they came, what else is streamed, and how it ended."""

    def __init__(self) -> None:
        self.stamps_s: list[float] = []
        self.arrivals_s: list[float] = []
        self.others: set[str] = set()
        self.not_finite, self.ended = 0, ""

    def record(self, settings: MocapCapture, kept: StreamFile) -> None:
        """Take poses for ``settings.seconds``; raises HardwareError where the line fails."""
        for device, stamp_s, pose in transforms(settings.host, settings.port):
            now = time.time()
            if device != settings.body:
                self.others.add(device)
                if not self.arrivals_s and len(self.others) > FEWEST:
                    return
            elif not all(map(math.isfinite, pose)):
                self.not_finite += 1
            elif not self.stamps_s or stamp_s > self.stamps_s[-1]:
                self.stamps_s.append(stamp_s)
                self.arrivals_s.append(now)
                kept.write((stamp_s - self.stamps_s[0], *pose))
            if self.arrivals_s and now - self.arrivals_s[0] >= settings.seconds:
                return
        self.ended = f"the server closed the line after {kept.count} poses"

    def notes(self) -> list[str]:
        """Rate, gaps and delay, and what is suspicious."""
        stamps, arrivals = np.array(self.stamps_s), np.array(self.arrivals_s)
        steps = np.diff(stamps)
        usual = float(np.median(steps))
        delay_ms = 1e3 * (arrivals - stamps)
        warnings = [
            f"{len(stamps)} poses at {1 / usual:.1f} Hz, {int((steps > 1.5 * usual).sum())} gaps (the longest step "
            f"{1e3 * float(steps.max()):.0f} ms), delay {np.median(delay_ms):.0f} ms by both clocks, varying by "
            f"{float(np.ptp(np.quantile(delay_ms, [0.05, 0.95]))):.1f} ms"
        ]
        if self.not_finite:
            warnings.append(f"{self.not_finite} poses were not finite numbers and are left out")
        lasted_s = float(arrivals[-1] - arrivals[0])
        ratio = float(stamps[-1] - stamps[0]) / max(lasted_s, 1e-9)
        if abs(ratio - 1) > CLOCK_SHARE and lasted_s > 1.0:
            warnings.append(f"the tracker's clock runs {ratio:.3f} times as fast as ours; durations are its own")
        if self.ended:
            warnings.append(f"{self.ended}; what came before is kept")
        return warnings


def _recorded(settings: MocapCapture, path: Path) -> tuple[str, ...]:
    """Keep the stream in ``path``; lines about it. Raises HardwareError where too little came."""
    stream = _Stream()
    with StreamFile(path, settings.body) as kept:
        try:
            stream.record(settings, kept)
        except HardwareError as wrong:
            stream.ended = str(wrong)
    if kept.count < FEWEST:
        if not kept.count:
            path.unlink()
        missing = f"'{settings.body}' does not come from {settings.host}:{settings.port}; look at capture.body"
        names = f"; it streams {', '.join(sorted(stream.others))}" if stream.others else ""
        raise HardwareError((stream.ended or missing) + names)
    return tuple(f"{path.name}: {one}" for one in stream.notes())
