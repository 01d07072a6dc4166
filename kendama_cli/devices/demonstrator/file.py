"""A demonstrator that is replayed from recordings: text, or poses in MCAP of an earlier capture or of others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.devices.demonstrator.axes import mirror_problem, parity
from kendama_cli.devices.demonstrator.interface import DemonstratorSample
from kendama_cli.devices.demonstrator.recording import Recording, unit_rotations
from kendama_cli.devices.demonstrator.segments import checked_swings
from kendama_cli.devices.demonstrator.settings import FileCapture
from kendama_cli.devices.demonstrator.text import read_text
from kendama_cli.devices.demonstrator.tidy import tidied
from kendama_cli.devices.recordings.columnar import columnar_texts
from kendama_cli.devices.recordings.mcap_poses import listed, pose_topics, read_pose_tracks
from kendama_cli.devices.recordings.poses import PoseTrack
from kendama_cli.devices.recordings.recording_format import (
    BAG,
    BVH,
    C3D,
    MCAP,
    NPZ,
    PARQUET,
    STREAM,
    TABLE,
    format_of,
    layout_command,
)
from kendama_cli.errors import InputError
from kendama_cli.log.reader import LogFile
from kendama_cli.motion.rotation import mapped
from kendama_cli.motion.sampling import step_s
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import UPRIGHT_WXYZ

USUAL_TOPIC = "/capture/cup"

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


class RecordedDemonstrator:
    """One recorded swing as a demonstrator; where a recording holds positions only, the cup is upright."""

    def __init__(self, name: str, recording: Recording) -> None:
        self.name = name
        self.rate_hz = 1.0 / step_s(recording.t_s)
        self.warnings, self.origin = recording.warnings, recording.origin
        self.likely_error_m = recording.likely_error_m
        self._recording = recording

    def samples(self) -> Iterator[DemonstratorSample]:
        """Yield every sample of the recording."""
        recording = self._recording
        rotations = [UPRIGHT] * len(recording.t_s) if recording.rotation_wxyz is None else recording.rotation_wxyz
        for t_s, position_m, rotation in zip(recording.t_s, recording.position_m, rotations, strict=True):
            yield DemonstratorSample(float(t_s), position_m, rotation, tracked=True)

    def render_force(self, force_n: Array) -> None:
        """Ignore the force: a recording feels nothing."""

    def close(self) -> None:
        """Do nothing: nothing is held."""


def open_files(settings: FileCapture) -> Sequence[RecordedDemonstrator]:
    """Open a demonstrator for every recording that the settings name, in their order; raises as ``recordings_of``."""
    return hands_of(recordings_of(settings))


def recordings_of(settings: FileCapture) -> list[Recording]:
    """Read every recording that the settings name, checked, in their order.

    Raises InputError for a file that cannot be read or does not hold a plausible swing.
    """
    paths = (settings.path,) if isinstance(settings.path, str) else settings.path or ()
    tidy = [tidied(_signed(one, settings), settings.times) for path in paths for one in _read(path, settings)]
    return [
        swing
        for one in tidy
        for swing in checked_swings(one, settings.plausible, settings.gap_factor, settings.segments)
    ]


def _signed(recording: Recording, settings: FileCapture) -> Recording:
    """Flip the recording's axes by ``capture.sign``; raises InputError if that mirrors rotations."""
    signs, columns = np.array([settings.sign.x, settings.sign.y, settings.sign.z], dtype=np.float64), settings.columns
    made = replace(recording, position_m=signs * recording.position_m)
    if recording.rotation_wxyz is None:
        return made
    named = settings.rotation
    order = 1 if named.w is None else parity((named.x, named.y, named.z)) or 1  # MCAP names no columns
    positions = order if named.w is None else parity((columns.x, columns.y, columns.z)) or order
    if positions != order:
        raise InputError(
            recording.path,
            f"capture.columns and capture.rotation take x, y and z in another order ({columns.x}, {columns.y}, "
            f"{columns.z}; {named.x}, {named.y}, {named.z})",
            remedy="name for each of our axes the position and the rotation about one axis of the file",
        )
    mirror = order * int(signs.prod())
    if problem := mirror_problem(mirror, settings.handedness):
        shown = f"x={settings.sign.x}, y={settings.sign.y}, z={settings.sign.z}"
        raise InputError(recording.path, f"capture.sign ({shown}) with capture.columns {problem}")
    return replace(made, rotation_wxyz=mapped(recording.rotation_wxyz, np.diag(signs), mirror))


def hands_of(recordings: Sequence[Recording]) -> tuple[RecordedDemonstrator, ...]:
    """Make a demonstrator for every recording; names that repeat are numbered."""
    names = Counter(recording.name for recording in recordings)
    seen: Counter[str] = Counter()
    hands = []
    for recording in recordings:
        seen[recording.name] += 1
        repeated = names[recording.name] > 1
        hands.append(
            RecordedDemonstrator(f"{recording.name}-{seen[recording.name]}" if repeated else recording.name, recording)
        )
    return tuple(hands)


def _read(path: str, settings: FileCapture) -> Sequence[Recording]:
    remedy = "set capture.path to a recording, a glob or a list of them"
    form = format_of(Path(path), remedy=remedy, folder_remedy=f"{remedy}, such as '{path}/*.csv'")
    if settings.format == "mcap" or (settings.format == "auto" and form is MCAP):
        return read_mcap(path, settings)
    if form in (PARQUET, NPZ):
        return [read_text(path, text.encode(), settings) for text in columnar_texts(path, form)]
    if form in (BAG, C3D, BVH):
        problem = f"is {form.name}, whose bodies capture=body reads"
        raise InputError(path, problem, remedy=f"type: {layout_command(path)}")
    try:
        return (read_text(path, Path(path).read_bytes(), settings),)
    except InputError as wrong:
        if form in (TABLE, STREAM):
            raise
        remedy = f"it is {form.name}, which capture=body reads; type: {layout_command(path)}"
        raise InputError(path, wrong.problem, where=wrong.where, remedy=remedy) from None


def read_mcap(path: str, settings: FileCapture) -> list[Recording]:
    """Read the recordings in the MCAP file ``path``, one per child frame of the topic.

    Raises InputError for a file that is cut short or damaged (every byte is checked), and for one without the topic.
    """
    topic = _topic(path, LogFile(path, topics=()).describe()["channels"], settings.topic)
    tracks = read_pose_tracks(path, (topic,))
    if settings.child is not None:
        chosen = [track for track in tracks if track.child == settings.child]
        if not chosen:
            named = ", ".join(f"'{track.child}'" for track in tracks)
            problem = f"no child frame '{settings.child}' on {topic}; it has {named}"
            raise InputError(path, problem, remedy="set capture.child to one of them")
        tracks = chosen
    from_start = settings.rotation.upright == "start"
    return [_recording(path, track, from_start) for track in tracks]


def _recording(path: str, track: PoseTrack, from_start: bool) -> Recording:
    t_ns = track.t_ns()

    def where(sample: int) -> str:
        return f"message {track.number[sample]} of {track.topic}"

    rotation = track.rotation_wxyz()
    if rotation is not None and (rotation == UPRIGHT_WXYZ).all():
        rotation = None
    return Recording(
        path,
        track.child or Path(path).stem,
        (t_ns - t_ns[0]) * 1e-9,
        np.array(track.position_m, dtype=np.float64),
        where,
        "look at capture.topic and have the poses logged in metres, as they are defined",
        "have the poses logged in a frame whose z points up and whose x lies in the swing's plane, or read them with "
        "capture=body and capture.axes",
        rotation_wxyz=None if rotation is None else unit_rotations(path, rotation, where, from_start=from_start),
    )


def _topic(path: str, channels: list[dict[str, Any]], named: str | None) -> str:
    fitting = pose_topics(channels)
    if named is None and len(fitting) == 1:
        return fitting[0]
    choice = named or USUAL_TOPIC
    if choice in fitting:
        return choice
    problem = f"no poses or transforms on the topic '{choice}'; it has {listed(channels)}"
    raise InputError(path, problem, remedy="set capture.topic to a topic with the cup's poses")
