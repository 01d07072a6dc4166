"""A haptic device that moves a virtual hand: stands behind the hand's interface and says what it needs."""

from __future__ import annotations

from collections.abc import Sequence

from kendama_cli.devices.hand.interface import HandDevice
from kendama_cli.devices.hand.settings import HapticCapture
from kendama_cli.errors import MissingPartError


def open_haptic(settings: HapticCapture) -> Sequence[HandDevice]:
    """Raises MissingPartError: no driver for a haptic device comes with this version."""
    raise MissingPartError(
        "haptic device",
        f"capture=haptic needs a haptic device (Phantom Omni or Touch) called '{settings.device}' (capture.device) and "
        "its driver (OpenHaptics with the Touch device driver), which is not part of this installation; "
        "record the swing otherwise and use capture=file capture.path=FILE",
    )
