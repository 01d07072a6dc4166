"""Images and films of others, opened with OpenCV: none is decoded that has more pixels than any camera of ours."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np

from kendama_cli import MOST_PIXELS
from kendama_cli.errors import InputError
from kendama_cli.vision.detection.interface import Image

SIZE = f"of at most {MOST_PIXELS // 1_000_000} million pixels"


def read_image(path: Path, where: str = "") -> Image:
    """Return pixels (h, w, 3), blue, green, red; raises InputError for what OpenCV cannot read."""
    try:
        coded = np.fromfile(path, dtype=np.uint8)
        pixels = cv2.imdecode(coded, cv2.IMREAD_COLOR) if len(coded) else None
    except OSError as error:
        raise InputError(str(path), f"the image cannot be read ({error.strerror})", where=where) from None
    except cv2.error:  # beyond the limit that kendama_cli sets
        raise InputError(str(path), f"it is not an image {SIZE}", where=where, remedy="scale it down") from None
    if pixels is None:
        problem = "it is not an image that OpenCV can read"
        raise InputError(str(path), problem, where=where, remedy="remove or convert it")
    return np.asarray(pixels, dtype=np.uint8)


def open_film(path: str | os.PathLike[str]) -> cv2.VideoCapture:
    """Return OpenCV's reader of a film, which may not be open; raises InputError where its frames are too large."""
    film = cv2.VideoCapture(os.fspath(path))
    width, height = film.get(cv2.CAP_PROP_FRAME_WIDTH), film.get(cv2.CAP_PROP_FRAME_HEIGHT)
    if width * height > MOST_PIXELS:
        film.release()
        problem = f"its frames are {width:.0f} x {height:.0f} px; allowed: {SIZE.removeprefix('of ')}"
        raise InputError(os.fspath(path), problem, remedy="convert it to a smaller one")
    return film
