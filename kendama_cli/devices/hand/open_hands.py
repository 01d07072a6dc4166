"""Opens the hands that the configuration names."""

from __future__ import annotations

from collections.abc import Sequence

from kendama_cli.devices.hand.interface import HandDevice
from kendama_cli.devices.hand.settings import HANDS, CaptureSettings


def open_hands(settings: CaptureSettings) -> Sequence[HandDevice]:
    """One device per demonstration, in order; raises InputError or MissingPartError where there is none."""
    return tuple(HANDS.maker(settings.kind)(settings))
