"""Which hands there are, by the kind of their settings."""

from __future__ import annotations

from collections.abc import Sequence

from kendama_cli.devices.hand.file import open_files
from kendama_cli.devices.hand.haptic import open_haptic
from kendama_cli.devices.hand.interface import HandDevice
from kendama_cli.devices.hand.mocap import open_mocap
from kendama_cli.devices.hand.settings import CaptureSettings, FileCapture, MocapCapture


def open_hands(settings: CaptureSettings) -> Sequence[HandDevice]:
    """One device per demonstration, in order; raises InputError or MissingPartError where there is none."""
    if isinstance(settings, FileCapture):
        return open_files(settings)
    if isinstance(settings, MocapCapture):
        return open_mocap(settings)
    return open_haptic(settings)
