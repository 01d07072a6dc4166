"""The hand of ``capture=play``: tries that were kept in the browser, as demonstrations."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from kendama_cli.devices.hand.file import RecordedHand, open_files
from kendama_cli.devices.hand.play.settings import PlayCapture
from kendama_cli.devices.hand.play.tries import Try, read_try
from kendama_cli.errors import InputError


def open_tries(settings: PlayCapture) -> Sequence[RecordedHand]:
    """A hand for every try that ``take`` asks for; raises InputError where there is none, or for one that is no swing.

    Files of the path that are no tries are left out.
    """
    paths = (settings.path,) if isinstance(settings.path, str) else settings.path or ()
    kept = [(path, one_try) for path in paths if (one_try := read_try(Path(path))) is not None]
    taken = tuple(path for path, one_try in kept if _takes(settings.take, one_try))
    if not taken:
        folder = str(Path(paths[0]).parent)
        raise InputError(
            folder,
            f"{len(kept)} tries, none of them {settings.take}",
            remedy="catch the ball in 'kendama play', or mark tries for the robot there, or set capture.take=all",
        )
    return open_files(dataclasses.replace(settings, path=taken))


def _takes(take: str, one_try: Try) -> bool:
    return take == "all" or (one_try.chosen if take == "chosen" else one_try.outcome == "caught")
