"""Opening of the demonstrators that the configuration names."""

from __future__ import annotations

from collections.abc import Sequence

from kendama_cli.devices.demonstrator.interface import Demonstrator
from kendama_cli.devices.demonstrator.settings import DEMONSTRATORS, CaptureSettings
from kendama_cli.devices.streams.live_figures import Tell, silent


def open_demonstrators(settings: CaptureSettings, tell: Tell = silent) -> Sequence[Demonstrator]:
    """Open one device per demonstration, in order; raises InputError or MissingPartError if there is none.

    ``tell`` is told how a stream comes while it is recorded, of hands whose settings say that they ``stream``.
    """
    make = DEMONSTRATORS.maker(settings.kind)
    return tuple(make(settings, tell) if getattr(settings, "streams", False) else make(settings))
