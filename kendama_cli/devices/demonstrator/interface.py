"""Interface of every demonstrator: a file that is replayed, motion capture, a haptic device."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from kendama_cli.devices.demonstrator.live_figures import Tell, silent
from kendama_cli.devices.demonstrator.settings import DEMONSTRATORS, CaptureSettings
from kendama_cli.schema.arrays import Array, set_arrays


@dataclass(frozen=True)
class DemonstratorSample:
    """The cup at ``t_s`` after the swing's first sample; where ``tracked`` is false the pose is the last one seen.

    ``position_m`` (3,), ``rotation_wxyz`` (4,) a unit quaternion; z points up, x lies in the swing plane.
    """

    t_s: float
    position_m: Array
    rotation_wxyz: Array
    tracked: bool

    def __post_init__(self) -> None:
        set_arrays(self, position_m=(3,), rotation_wxyz=(4,))


class Demonstrator(Protocol):
    """One swing of a person; ``name`` is what the demonstration is called.

    It may also have ``warnings``, a tuple of sentences about what is suspicious in it but possible: capture reports
    them.
    """

    name: str
    rate_hz: float

    def samples(self) -> Iterator[DemonstratorSample]:
        """Yield the swing from first to last sample, in the order of time; raises InputError or HardwareError."""

    def render_force(self, force_n: Array) -> None:
        """Let the hand feel ``force_n`` (3,); devices without force feedback ignore it."""

    def close(self) -> None:
        """Let go of the device; idempotent."""


def open_demonstrators(settings: CaptureSettings, tell: Tell = silent) -> Sequence[Demonstrator]:
    """Open one device per demonstration, in order; raises InputError or MissingPartError if there is none.

    ``tell`` receives the progress of demonstrators whose settings say ``streams``: a stream is recorded, a video read.
    """
    make = DEMONSTRATORS.maker(settings.kind)
    return tuple(make(settings, tell) if getattr(settings, "streams", False) else make(settings))
