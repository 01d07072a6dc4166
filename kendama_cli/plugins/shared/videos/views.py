"""Images of a calibration board, camera by camera: from folders, lists of images, or videos."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import InputError
from kendama_cli.plugins.shared.videos.video import VideoFile, read_image

IMAGES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
FROM_VIDEO = 40
"""A video gives so many frames, evenly spread; neighbours add nothing."""


def cameras_of(paths: Sequence[Path]) -> dict[str, list[Path]]:
    """Group sources by camera: images of one folder make a camera of its name, a video one of the file's name.

    Raises InputError where a path is not there or holds no image, or two cameras would have one name.
    """
    made: dict[str, list[Path]] = {}
    homes: dict[str, Path] = {}
    for path in paths:
        if path.is_dir():
            name, home = path.resolve().name, path.resolve()
            found = sorted(item for item in path.iterdir() if item.suffix.lower() in IMAGES)
            if not found:
                raise InputError(str(path), "it holds no image", remedy=f"images end in {', '.join(IMAGES)}")
        elif not path.is_file():
            raise InputError(str(path), "no such file or folder", remedy="give a folder of images, or a video")
        elif path.suffix.lower() in IMAGES:
            name, home, found = path.resolve().parent.name, path.resolve().parent, [path]
        else:
            name, home, found = path.stem, path.resolve(), [path]
        if homes.setdefault(name, home) != home:
            raise InputError(str(path), f"two cameras would be called '{name}'", remedy="rename a folder or video")
        made.setdefault(name, []).extend(found)
    return made


def read_views(sources: Sequence[Path]) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    """Name and pixels (h, w, 3) of each view; raises InputError for what cannot be read, or changes its size."""
    size: tuple[int, ...] | None = None
    for source in sources:
        for name, pixels in _images(source):
            if size is not None and pixels.shape != size:
                raise InputError(
                    str(source),
                    f"its image '{name}' is {pixels.shape[1]} x {pixels.shape[0]} px after {size[1]} x {size[0]} px",
                    remedy="calibrate images of one size at a time",
                )
            size = pixels.shape
            yield name, pixels


def _images(source: Path) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    if source.suffix.lower() in IMAGES:
        yield source.stem, read_image(source)
        return
    video = VideoFile(source)
    count = video.count()  # a container's own count may hold frames that its edit list hides
    chosen = set(np.linspace(0, count - 1, min(count, FROM_VIDEO)).round().astype(int).tolist())
    for number, (_, pixels) in enumerate(video.frames()):
        if number in chosen:
            yield f"frame {number}", pixels
