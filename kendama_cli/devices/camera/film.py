"""The frames of a film, each with its own time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.vision.interface import Image

REMEDY = "convert it, e.g. to mp4 with H.264"


class Film:
    """A film file; frames come with the time stamps of the file (a phone's frame rate varies), turned upright as its
    metadata says.

    Raises InputError for what OpenCV cannot read as a film.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.name = path, path.stem
        if not path.is_file():
            raise InputError(str(path), "no such film", remedy="give a video file per camera")
        first = next(self.frames(), None)
        if first is None:
            raise InputError(str(path), "OpenCV cannot read it as a film", remedy=REMEDY)
        self.width_px, self.height_px = first[1].shape[1], first[1].shape[0]

    def frames(self, every: int = 1) -> Iterator[tuple[float, Image]]:
        """Time [s] and pixels (h, w, 3) of every ``every``-th frame.

        A stamp that does not rise (some containers have none) is put one frame period after the one before.
        """
        capture = cv2.VideoCapture(str(self.path))
        try:
            rate_hz = capture.get(cv2.CAP_PROP_FPS)
            period_s = 1 / rate_hz if 1 <= rate_hz <= 2000 else 1 / 30
            before_s, number = -period_s, 0
            while True:
                if not capture.grab():
                    return
                t_s = capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3
                before_s = t_s if t_s > before_s else before_s + period_s
                if number % every == 0:
                    good, pixels = capture.retrieve()
                    if not good:
                        return
                    yield before_s, np.asarray(pixels, dtype=np.uint8)
                number += 1
        finally:
            capture.release()

    def count(self) -> int:
        """Number of frames that can be decoded."""
        capture = cv2.VideoCapture(str(self.path))
        number = 0
        while capture.grab():
            number += 1
        capture.release()
        return number
