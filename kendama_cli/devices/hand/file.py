"""A hand that is replayed from recordings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from kendama_cli.devices.hand.interface import HandSample
from kendama_cli.devices.hand.mcap_log import read_mcap
from kendama_cli.devices.hand.recording import Recording
from kendama_cli.devices.hand.segments import checked_swings
from kendama_cli.devices.hand.settings import FileCapture
from kendama_cli.devices.hand.text import read_text
from kendama_cli.errors import InputError
from kendama_cli.log.container_summary import MAGIC
from kendama_cli.schema.arrays import Array

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


class RecordedHand:
    """One recorded swing behind the hand's interface; where a recording holds places only the cup is upright."""

    def __init__(self, name: str, recording: Recording) -> None:
        self.name = name
        self.rate_hz = float(1.0 / np.median(np.diff(recording.t_s)))
        self.warnings = recording.warnings
        self._recording = recording

    def samples(self) -> Iterator[HandSample]:
        """Every sample of the recording."""
        recording = self._recording
        turns = [UPRIGHT] * len(recording.t_s) if recording.rotation_wxyz is None else recording.rotation_wxyz
        for t_s, position_m, rotation in zip(recording.t_s, recording.position_m, turns, strict=True):
            yield HandSample(float(t_s), position_m, rotation, tracked=True)

    def render_force(self, force_n: Array) -> None:
        """Ignored: a recording feels nothing."""

    def close(self) -> None:
        """Nothing is held."""


def open_files(settings: FileCapture) -> Sequence[RecordedHand]:
    """A hand for every recording that the settings name, in their order.

    Raises InputError for a file that cannot be read or does not hold a plausible swing.
    """
    paths = (settings.path,) if isinstance(settings.path, str) else settings.path or ()
    recordings = [
        swing
        for path in paths
        for recording in _read(path, settings)
        for swing in checked_swings(recording, settings.plausible, settings.gap_factor, settings.segments)
    ]
    return hands_of(recordings)


def hands_of(recordings: Sequence[Recording]) -> tuple[RecordedHand, ...]:
    """A hand for every recording; names that repeat are numbered."""
    names = Counter(recording.name for recording in recordings)
    seen: Counter[str] = Counter()
    hands = []
    for recording in recordings:
        seen[recording.name] += 1
        repeated = names[recording.name] > 1
        hands.append(
            RecordedHand(f"{recording.name}-{seen[recording.name]}" if repeated else recording.name, recording)
        )
    return tuple(hands)


def _read(path: str, settings: FileCapture) -> Sequence[Recording]:
    file = Path(path)
    remedy = "set capture.path to a recording, a glob or a list of them"
    if file.is_dir():
        raise InputError(path, "is a folder, not a file", remedy=f"{remedy}, such as '{path}/*.csv'")
    try:
        content = file.read_bytes()
    except FileNotFoundError:
        raise InputError(path, "no such file", remedy=remedy) from None
    except OSError as wrong:
        raise InputError(path, f"cannot be read ({wrong.strerror})", remedy=remedy) from None
    if not content.strip():
        raise InputError(path, "is empty, no row", remedy="give a file that holds a swing")
    named = file.suffix.lower() == ".mcap"
    if settings.format == "mcap" or (settings.format == "auto" and (named or content.startswith(MAGIC))):
        return read_mcap(path, settings)
    return (read_text(path, content, settings),)
