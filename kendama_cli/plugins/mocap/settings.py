"""Settings of ``capture=body`` and ``capture=mocap``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.devices.demonstrator.axes import HANDEDNESS, Axes, Handedness, determinant, mirror_problem, to_ours
from kendama_cli.devices.demonstrator.settings import TIMES, PlausibleSettings
from kendama_cli.devices.streams.stream_server import StreamServer
from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting
from kendama_cli.schema.units import LengthUnit


@dataclass(frozen=True)
class BodySettings:
    """A tracked body on the cup: its axes, where the cup is in it, and what its swings can be."""

    plausible: PlausibleSettings
    axes: Axes = setting("axes of the file that are our x, y and z (up): [x, -z, y] for y up")
    body_to_cup_m: tuple[float, float, float] = setting(
        "vector from the body's origin to the cup's tie point, in the body's axes (kendama capture pivot) [m]"
    )
    upright: Literal["start", "given"] = setting(
        "start: the cup is upright where the recording begins; given: the body's own axes are the cup's"
    )
    max_gap_s: float = setting("longest stretch without the body that is bridged [s]", above=0)
    times: Literal["even", "stamps"] = setting(TIMES)
    segments: Literal["auto", "one"] = setting("auto: several swings in a file are cut apart where the hand rests")
    handedness: Handedness = setting(HANDEDNESS, absent="right")

    def __post_init__(self) -> None:
        to_ours(self.axes)


@dataclass(frozen=True)
class BodyCapture(BodySettings):
    """A tracked body in the files of motion capture systems and robots, and the ball where it was tracked too."""

    kind: Literal["body"] = setting("a tracked body in files")
    path: str | tuple[str, ...] | None = setting("file, glob or list of them", file=True)
    body: str | None = setting("name of the rigid body on the cup (a marker, topic or child frame); null: the only one")
    ball: str | None = setting("name of the ball's marker; null: it was not tracked")
    unit: LengthUnit | None = setting("unit of a file that does not tell it, as BVH does not", absent=None)
    misses: Literal["drop", "keep"] = setting("swings after which the ball is not in the cup, where it was tracked")

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

    kind: Literal["mocap"] = setting("a tracked body that is streamed now")
    body: str = setting(
        "name of the rigid body on the cup: of its transform, or of its VRPN tracker (TRACKER:1 for its sensor 1)"
    )
    seconds: float = setting("duration of the recording [s]", above=0)
    record: str = setting("file of the raw stream; it is never overwritten")

    def __post_init__(self) -> None:
        super().__post_init__()
        # before anybody swings: a stream always holds orientations
        if problem := mirror_problem(determinant(self.axes), self.handedness):
            raise ConfigError("axes", f"'axes' is {list(self.axes)}, which {problem}")
