"""The hand of ``capture=play``: tries that were kept in the browser, as demonstrations."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from kendama_cli.devices.demonstrator.file import RecordedDemonstrator, hands_of, recordings_of
from kendama_cli.devices.demonstrator.recording import Recording
from kendama_cli.errors import InputError
from kendama_cli.plugins.teleoperation.play.settings import PlayCapture
from kendama_cli.plugins.teleoperation.play.tries import Try, read_try


def open_tries(settings: PlayCapture) -> Sequence[RecordedDemonstrator]:
    """Open a demonstrator for every try that ``take`` asks for; a try without a swing is left out, with a warning.

    Files of the path that are no tries are left out. Raises InputError where none is left.
    """
    paths = (settings.path,) if isinstance(settings.path, str) else settings.path or ()
    kept = [(path, one_try) for path in paths if (one_try := read_try(Path(path))) is not None]
    taken = [path for path, one_try in kept if _takes(settings.take, one_try)]
    if not taken:
        folder = str(Path(paths[0]).parent)
        raise InputError(
            folder,
            f"tries: {len(kept)}, none of them {settings.take}",
            remedy="catch the ball in 'kendama play', or mark tries for the robot there, or set capture.take=all",
        )
    swings, refused = list[Recording](), list[InputError]()
    for path in taken:
        try:
            swings += recordings_of(dataclasses.replace(settings, path=path))
        except InputError as error:
            refused.append(error)
    if not swings:
        raise refused[0]
    left = tuple(f"left out: {error}" for error in refused)
    return hands_of([dataclasses.replace(swings[0], warnings=left + swings[0].warnings), *swings[1:]])


def doubt_of(settings: PlayCapture, file: Path) -> str | None:
    """Say why ``open_tries`` leaves ``file`` out; None where it takes it."""
    try:
        recordings_of(dataclasses.replace(settings, path=str(file)))
    except InputError as error:
        return f"{error.where}: {error.problem}" if error.where else error.problem
    return None


def _takes(take: str, one_try: Try) -> bool:
    return take == "all" or (one_try.chosen if take == "chosen" else one_try.outcome == "caught")
