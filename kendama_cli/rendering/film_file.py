"""A film rendered by several processes into one file."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import InputError
from kendama_cli.rendering.film import HEIGHT_PX, RATE_HZ, WIDTH_PX, FilmMaker
from kendama_cli.rendering.film_writer import h264_film, vp8_film
from kendama_cli.rendering.mesh import LinkMesh, Surface, unit_cylinder
from kendama_cli.report.replay.performance import Performance
from kendama_cli.settings.game import GameSettings
from kendama_cli.system.processes import process_pool

FILMS = {".webm": vp8_film, ".mp4": h264_film}
"""Kinds of film by their name's ending."""
_AT_ONCE = 8
"""Pictures of one task: long enough to be worth a message, short enough to keep all processes busy to the end."""
_maker: FilmMaker | None = None


def check_film_name(path: Path) -> None:
    """Raise InputError for a name that no film can have, or a folder that is not there."""
    if path.suffix.lower() not in FILMS:
        raise InputError(
            str(path),
            f"a film ends in {' or '.join(FILMS)}",
            remedy=f"name it {path.stem or 'catch'}{next(iter(FILMS))}",
        )
    if not path.absolute().parent.is_dir():
        raise InputError(str(path), "its folder is not there", remedy="make the folder, or name another one")
    if path.is_dir():
        raise InputError(str(path), "it is a folder", remedy="name a file")


def write_film(motion: Performance, game: GameSettings, path: Path) -> int:
    """Render ``motion`` into ``path``, which is replaced only by a whole film; how many pictures it has.

    Raises InputError where the film cannot be written there, MissingPartError where Embree, or PyAV for .mp4, is not
    installed.
    """
    check_film_name(path)
    Surface(LinkMesh(*unit_cylinder(3), (0.0, 0.0, 0.0)))  # says here, not in a process, where Embree is missing
    suffix = path.suffix.lower()
    unfinished = path.with_name(f".{path.stem}.{os.getpid()}{suffix}")
    try:
        try:
            unfinished.touch()
        except OSError as error:
            raise _unwritable(path) from error
        with FILMS[suffix](unfinished, RATE_HZ, WIDTH_PX, HEIGHT_PX) as write:
            count = 0
            for picture in _pictures(motion, game):
                write(picture)
                count += 1
        try:
            unfinished.replace(path)
        except OSError as error:
            raise _unwritable(path) from error
    finally:
        unfinished.unlink(missing_ok=True)
    return count


def _pictures(motion: Performance, game: GameSettings) -> Iterator[NDArray[np.uint8]]:
    """Yield the film's pictures in order; each process renders with one thread."""
    moments = FilmMaker.moments(motion)
    tasks = [moments[k : k + _AT_ONCE] for k in range(0, len(moments), _AT_ONCE)]
    with process_pool(_begin, motion, game) as pool:
        for pictures in pool.map(_render, tasks):
            yield from pictures


def _begin(motion: Performance, game: GameSettings) -> None:
    global _maker  # noqa: PLW0603 - one per process, made when it begins
    cv2.setNumThreads(1)
    _maker = FilmMaker(motion, game)


def _render(moments: Sequence[tuple[float, float]]) -> list[NDArray[np.uint8]]:
    assert _maker is not None
    return [_maker.picture(*moment) for moment in moments]


def _unwritable(path: Path) -> InputError:
    return InputError(str(path), "the film cannot be written there", remedy="name a place that you may write to")
