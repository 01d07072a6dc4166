"""The video of a run: a motion in its logs, rendered by several processes into one file; it resumes after a kill."""

from __future__ import annotations

import contextlib
import dataclasses
import glob
import hashlib
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import zstandard
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
_AT_ONCE = 8
"""Images of one task: long enough to be worth a message, short enough to keep all processes busy to the end."""
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

    Images are stored in a folder beside it until then, so that the same call resumes after it was killed.
    ``progress`` is told the images that are done and all of them.

    Raises InputError where the video cannot be written there, MissingPartError where Embree, or PyAV for .mp4, is not
    installed.
    """
    check_video_name(path)
    Surface(LinkMesh(*unit_cylinder(3), (0.0, 0.0, 0.0)))  # says here, not in a process, where Embree is missing
    suffix = path.suffix.lower()
    parts = path.with_name(f".{path.name}.parts-{_digest(motion, game)}")
    unfinished = parts / f"{os.getpid()}{suffix}"
    try:
        parts.mkdir(exist_ok=True)
        unfinished.touch()
        count = 0
        with WRITERS[suffix](unfinished, RATE_HZ, WIDTH_PX, HEIGHT_PX) as write:
            for image in _images(motion, game, parts, progress or (lambda _done, _total: None)):
                write(image)
                count += 1
        unfinished.replace(path)
    except OSError as error:
        raise InputError(
            str(path), "the video cannot be written there", remedy="name a folder that you may write to"
        ) from error
    finally:
        unfinished.unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # images are in it
            parts.rmdir()
    for of_before in path.parent.glob(f".{glob.escape(path.name)}.parts-*"):
        shutil.rmtree(of_before, ignore_errors=True)
    return count


def _digest(motion: Performance, game: GameSettings) -> str:
    """Return what the images depend on, in short: the motion, the game and the code that draws them."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    _add(digest, (motion, game))
    return digest.hexdigest()[:16]


def _add(digest: hashlib._Hash, value: Any) -> None:
    """Add everything that ``value`` holds."""
    if isinstance(value, np.ndarray):
        digest.update(f"{value.shape}".encode() + value.tobytes())
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            digest.update(field.name.encode())
            _add(digest, getattr(value, field.name))
    elif isinstance(value, tuple | list):
        digest.update(f"{len(value)}".encode())
        for one in value:
            _add(digest, one)
    else:
        digest.update(repr(value).encode())


def _images(motion: Performance, game: GameSettings, parts: Path, progress: Progress) -> Iterator[NDArray[np.uint8]]:
    """Yield the video's images in order, those in ``parts`` as they are; each process renders with one thread."""
    moments = VideoMaker.moments(motion)
    tasks = [moments[k : k + _AT_ONCE] for k in range(0, len(moments), _AT_ONCE)]
    paths = [parts / f"{k:05d}.zst" for k in range(len(tasks))]
    missing = [k for k, file in enumerate(paths) if not file.exists()]
    with process_pool(_begin, motion, game) as pool:
        rendered = {k: pool.submit(_render, tasks[k], paths[k]) for k in missing}
        done = 0
        for k, task in enumerate(tasks):
            if k in rendered:
                rendered[k].result()
            images = _stored(paths[k], len(task))
            if images is None:  # the machine stopped while it was written
                pool.submit(_render, task, paths[k]).result()
                images = _stored(paths[k], len(task))
                assert images is not None
            yield from images
            done += len(task)
            progress(done, len(moments))


def _begin(motion: Performance, game: GameSettings) -> None:
    global _maker  # noqa: PLW0603 - one per process, made when it begins
    cv2.setNumThreads(1)
    _maker = VideoMaker(motion, game)


def _render(moments: Sequence[tuple[float, float]], path: Path) -> None:
    """Render images into ``path``, which is there only whole."""
    assert _maker is not None
    images = np.stack([_maker.image(*moment) for moment in moments])
    scratch = path.with_suffix(f".{os.getpid()}")
    scratch.write_bytes(zstandard.ZstdCompressor(level=1, write_checksum=True).compress(images.tobytes()))
    scratch.replace(path)


def _stored(path: Path, count: int) -> NDArray[np.uint8] | None:
    """Return the images (count, height, width, 3) in ``path``; None where it is damaged."""
    try:
        data = zstandard.ZstdDecompressor().decompress(path.read_bytes())
        return np.frombuffer(data, np.uint8).reshape(count, HEIGHT_PX, WIDTH_PX, 3)
    except (zstandard.ZstdError, ValueError):
        return None
