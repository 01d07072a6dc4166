"""Motion capture of the cup: stands behind the hand's interface and says what it needs."""

from __future__ import annotations

from collections.abc import Sequence

from kendama_cli.devices.hand.interface import HandDevice
from kendama_cli.devices.hand.settings import MocapCapture
from kendama_cli.errors import MissingPartError


def open_mocap(settings: MocapCapture) -> Sequence[HandDevice]:
    """Raises MissingPartError: no driver for a motion capture system comes with this version."""
    raise MissingPartError(
        "motion capture",
        f"capture=mocap needs a motion capture system (OptoTrak, OptiTrack or Qualisys) with a rigid body "
        f"'{settings.body}' on the cup, its server at {settings.host}:{settings.port} (capture.host, capture.port, "
        f"capture.body) and a driver for that server, which is not part of this installation; "
        "export the recording as CSV or TSV and use capture=file capture.path=FILE",
    )
