"""The video of a run: a motion in its logs, rendered by several processes into one file."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import InputError
from kendama_cli.log.reader import logged_settings
from kendama_cli.pipeline.report import logs_of
from kendama_cli.plugins.publication.video_maker import HEIGHT_PX, RATE_HZ, WIDTH_PX, VideoMaker
from kendama_cli.plugins.shared.videos.video_writer import h264_video, vp8_video
from kendama_cli.rendering.mesh import LinkMesh, Surface, unit_cylinder
from kendama_cli.report.chapters import declaration_of, performances
from kendama_cli.report.replay.performance import Performance
from kendama_cli.report.source import StageLog
from kendama_cli.settings.game import GameSettings
from kendama_cli.system.processes import process_pool

WRITERS = {".webm": vp8_video, ".mp4": h264_video}
"""Kinds of video by their name's ending."""
Progress = Callable[[int, int], None]
_AHEAD = 32
"""Images that are rendered before their turn: enough to keep all processes busy, 90 MB at most."""
_maker: VideoMaker | None = None


def video_of_run(records: Sequence[Mapping[str, Any]], path: Path, progress: Progress | None = None) -> int:
    """Write the video of a run's first motion with an arm, or else of its first motion; how many images it has.

    Raises InputError for several runs, where no log of the one moves a ball, and for a place where no video can be.
    """
    if len(records) != 1:
        raise InputError(str(path), f"{len(records)} runs are chosen", remedy="name one run: a video shows one")
    (record,) = records
    check_video_name(path)
    found = _motions(record)
    if not found:
        raise InputError(
            f"run {record['run']}",
            "no log of it moves a cup and a ball",
            remedy="render a run of adapt, learn or transfer (kendama runs)",
        )
    motion, log = min(found, key=lambda one: one[0].links is None)
    return write_video(motion, logged_settings(GameSettings, log.settings["game"], "game", log.path), path, progress)


def _motions(record: Mapping[str, Any]) -> list[tuple[Performance, StageLog]]:
    entries = {str(stage["name"]): stage for stage in record["stages"]}
    found = []
    for name, path in logs_of(record).items():
        declaration = declaration_of(name, entries.get(name, {}))
        if declaration is None or declaration.replay is None:
            continue
        log = StageLog(path)
        if "game" in log.settings:
            found += [(one, log) for one in performances(declaration, log) if "ball" in one.bodies.names]
    return found


def check_video_name(path: Path) -> None:
    """Raise InputError for a name that no video can have, or a folder that is not there."""
    if path.suffix.lower() not in WRITERS:
        raise InputError(
            str(path),
            f"a video ends in {' or '.join(WRITERS)}",
            remedy=f"name it {path.stem or 'catch'}{next(iter(WRITERS))}",
        )
    if not path.absolute().parent.is_dir():
        raise InputError(str(path), "its folder is not there", remedy="make the folder, or name another one")
    if path.is_dir():
        raise InputError(str(path), "it is a folder", remedy="name a file")


def write_video(motion: Performance, game: GameSettings, path: Path, progress: Progress | None = None) -> int:
    """Render ``motion`` into ``path``, which is replaced only by a whole video; how many images it has.

    ``progress`` is told the images that are done and all of them.

    Raises InputError where the video cannot be written there, MissingPartError where Embree, or PyAV for .mp4, is not
    installed.
    """
    check_video_name(path)
    Surface(LinkMesh(*unit_cylinder(3), (0.0, 0.0, 0.0)))  # says here, not in a process, where Embree is missing
    suffix = path.suffix.lower()
    unfinished = path.with_name(f".{path.stem}.{os.getpid()}{suffix}")
    moments, rendered = VideoMaker.moments(motion), deque[Future[NDArray[np.uint8]]]()
    try:
        unfinished.touch()
        with (
            WRITERS[suffix](unfinished, RATE_HZ, WIDTH_PX, HEIGHT_PX) as write,
            process_pool(_begin, motion, game) as pool,
        ):
            for done in range(len(moments)):
                waiting = moments[done + len(rendered) : done + _AHEAD]
                rendered.extend(pool.submit(_render, moment) for moment in waiting)
                write(rendered.popleft().result())
                if progress is not None:
                    progress(done + 1, len(moments))
        unfinished.replace(path)
    except OSError as error:
        raise InputError(
            str(path), "the video cannot be written there", remedy="name a folder that you may write to"
        ) from error
    finally:
        unfinished.unlink(missing_ok=True)
    return len(moments)


def _begin(motion: Performance, game: GameSettings) -> None:
    global _maker  # noqa: PLW0603 - one per process, made when it begins
    cv2.setNumThreads(1)
    _maker = VideoMaker(motion, game)


def _render(moment: tuple[float, float]) -> NDArray[np.uint8]:
    assert _maker is not None
    return _maker.image(*moment)
