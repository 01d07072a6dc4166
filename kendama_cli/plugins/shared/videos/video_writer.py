"""Writers of video files: VP8 by OpenCV, which is always there, H.264 by PyAV."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import InputError, MissingPartError, install_line

Write = Callable[[NDArray[np.uint8]], None]
"""Takes the next image (h, w, 3), blue green red."""
QUALITY = "20"
"""H.264's constant rate factor: no loss is seen."""


@contextlib.contextmanager
def vp8_video(path: Path, rate_hz: float, width_px: int, height_px: int) -> Iterator[Write]:
    """Open a video that browsers play; raises InputError where OpenCV cannot write it."""
    with _quiet():  # it says that it takes a tag of its own for VP8 in WebM
        code = cv2.VideoWriter.fourcc(*"VP80")
        writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, rate_hz, (width_px, height_px))
    if not writer.isOpened():
        raise InputError(str(path), "OpenCV cannot write VP8 here", remedy="install opencv-python-headless from PyPI")

    def write(image: NDArray[np.uint8]) -> None:
        writer.write(image)

    try:
        yield write
    finally:
        writer.release()


@contextlib.contextmanager
def h264_video(path: Path, rate_hz: float, width_px: int, height_px: int) -> Iterator[Write]:
    """Open a video that everything plays; raises MissingPartError without the extra ``film``."""
    try:
        import av  # noqa: PLC0415 - of the extra film
    except ImportError:
        raise MissingPartError(
            "film", f"{path.name}: .mp4 needs PyAV; {install_line('film')}, or name the video .webm"
        ) from None
    with av.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=round(rate_hz), options={"crf": QUALITY})
        stream.width, stream.height, stream.pix_fmt = width_px, height_px, "yuv420p"

        def write(image: NDArray[np.uint8]) -> None:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="bgr24")))

        yield write
        container.mux(stream.encode(None))


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Hide what a library writes to the standard error itself."""
    sys.stderr.flush()
    kept = os.dup(2)
    silent = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(silent, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(silent)
