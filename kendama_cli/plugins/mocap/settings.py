"""Settings of ``capture=body`` and ``capture=mocap``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.devices.demonstrator.axes import HANDEDNESS, Axes, Handedness, determinant, mirror_problem, to_ours
from kendama_cli.devices.demonstrator.settings import TIMES, PlausibleSettings
from kendama_cli.errors import ConfigError
from kendama_cli.plugins.shared.streams.stream_server import StreamServer
from kendama_cli.schema.settings import setting
from kendama_cli.schema.units import LengthUnit


@dataclass(frozen=True)
class BodySettings:
    """A tracked body on the cup: its axes, the cup's pose in it, and plausible ranges of its swings."""

    plausible: PlausibleSettings
    axes: Axes = setting("Axes of the file that are kendama's x, y and z (up); [x, -z, y] if the file has y up.")
    body_to_cup_m: tuple[float, float, float] = setting(
        "Tie point of the rope in the tracked body's axes, from its origin [m]. 'kendama capture pivot' measures it."
    )
    upright: Literal["start", "given"] = setting(
        "Reference of the orientation: 'start' takes the cup as upright where the recording starts, 'given' takes the "
        "body's axes as the cup's."
    )
    max_gap_s: float = setting(
        "Gaps without the body of up to this duration are interpolated, longer ones refused [s].", above=0
    )
    times: Literal["even", "stamps"] = setting(TIMES)
    segments: Literal["auto", "one"] = setting(
        "Swings in one file: 'auto' splits it where the hand rests, 'one' takes it as one swing."
    )
    handedness: Handedness = setting(HANDEDNESS, absent="right")

    def __post_init__(self) -> None:
        to_ours(self.axes)


@dataclass(frozen=True)
class BodyCapture(BodySettings):
    """A tracked body in files of motion capture systems and robots, with the ball if it was tracked too."""

    kind: Literal["body"] = setting("The demonstrations are files of a tracked body.")
    path: str | tuple[str, ...] | None = setting("File, glob or list of files.", file=True)
    body: str | None = setting(
        "Name of the rigid body on the cup (a marker, topic or child frame); null takes the only one."
    )
    ball: str | None = setting("Name of the ball's marker; null if the ball was not tracked.")
    unit: LengthUnit | None = setting(
        "Unit of the positions, for a file that does not state it, such as BVH.", absent=None
    )
    misses: Literal["drop", "keep"] = setting(
        "Swings that do not end with the ball in the cup, if it was tracked: 'drop' leaves them out, 'keep' takes them."
    )

    def __post_init__(self) -> None:
        if not self.path:
            raise ConfigError("path", "'path' names no recording; set it to a file, a glob or a list of files")
        super().__post_init__()


@dataclass(frozen=True)
class MocapCapture(StreamServer, BodySettings):
    """A motion capture system that streams the pose of a rigid body fixed to the cup, by OpenIGTLink or VRPN."""

    live: ClassVar[bool] = True
    streams: ClassVar[bool] = True
    """A person swings for it: what was recorded is kept until someone asks for another recording."""

    kind: Literal["mocap"] = setting("A tracked body is recorded from a live stream.")
    body: str = setting(
        "Name of the rigid body on the cup: that of its transform, or of its VRPN tracker (TRACKER:1 for sensor 1)."
    )
    seconds: float = setting("Duration of the recording [s].", above=0)
    record: str = setting("File of the raw stream, which is never overwritten.")

    def __post_init__(self) -> None:
        super().__post_init__()
        # before anybody swings: a stream always holds orientations
        if problem := mirror_problem(determinant(self.axes), self.handedness):
            raise ConfigError("axes", f"'axes' is {list(self.axes)}, which {problem}")
