"""Recorded cameras: a video, or a folder of images with their time stamps."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kendama_cli.devices.camera.interface import (
    Frame,
    RegionOfInterest,
    SceneSource,
    StaleFrame,
    require_one_each,
    too_old,
)
from kendama_cli.errors import InputError
from kendama_cli.plugins.shared.videos.video import VideoFile, read_image
from kendama_cli.schema.listed_file import listed_file
from kendama_cli.settings.camera import FileCamera
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.region import Region

COLUMNS = ("file", "t_s")
ESTIMATED = 2
"""Frames, and two in a hundred, by which a whole video may fall short of what its head announces."""


def open_file(
    settings: FileCamera, models: Sequence[CameraModel], clock: Callable[[], float], scene: SceneSource | None
) -> list[FileCameraBlock]:
    """Open recordings, see OpenCameras; raises ConfigError unless there is one path per camera, InputError."""
    require_one_each("camera.paths", settings.paths, "a video, or the times.csv of an image folder", len(models))
    return [
        FileCameraBlock(model, path, clock=clock, rate_hz=settings.rate_hz)
        for model, path in zip(models, settings.paths, strict=True)
    ]


class FileCameraBlock:
    """Shows, at each time of ``clock``, the newest recorded frame; a recording plays forward only.

    A path that ends in .csv lists images beside it: columns ``file`` and ``t_s``, mid-exposure in seconds, rising.
    Anything else is a video, whose frames lie 1/rate seconds apart. Raises InputError for what cannot be read.
    """

    def __init__(
        self, model: CameraModel, path: str, *, clock: Callable[[], float], rate_hz: float | None = None
    ) -> None:
        self.model = model
        self._path, self._clock, self._region = path, clock, RegionOfInterest(model)
        self._source: _Images | _Video = _Images(path) if path.endswith(".csv") else _Video(path, rate_hz)
        self._shown: tuple[float, NDArray[np.uint8]] | None = None
        self._next = self._advance()
        if self._next is None:
            raise InputError(path, "it holds no frame that can be read", remedy="check it with another player")

    @property
    def next_s(self) -> float | None:
        """The stamp of the frame after the newest; None at the recording's end."""
        return None if self._next is None else self._next[0]

    def set_region_of_interest(self, region: Region | None) -> None:
        self._region.set(region)

    def latest(self, *, max_age_s: float) -> Frame:
        now = self._clock()
        while self._next is not None and self._next[0] <= now + 1e-9:
            self._shown, self._next = self._next, self._advance()
        if self._shown is None:
            raise StaleFrame(
                self.model.name, math.inf, f"camera '{self.model.name}': {self._path} has no frame before {now:.3f} s"
            )
        t_s, pixels = self._shown
        if now - t_s > max_age_s:
            raise too_old(self.model.name, now - t_s, max_age_s)
        return self._region.frame(t_s, pixels)

    def restart(self) -> None:
        """Raise: a recording plays forward only."""

    def close(self) -> None:
        self._source.close()

    def _advance(self) -> tuple[float, NDArray[np.uint8]] | None:
        found = self._source.read()
        if found is None:
            return None
        known = (self.model.height_px, self.model.width_px, 3)
        if found[1].shape != known:
            height, width = found[1].shape[:2]
            raise InputError(
                self._path,
                f"its images are {width} x {height} px, but camera '{self.model.name}' is calibrated for "
                f"{known[1]} x {known[0]} px",
                where=f"frame at {found[0]:.3f} s",
                remedy="calibrate for this size, or record in the calibrated one",
            )
        return found


class _Video:
    def __init__(self, path: str, rate_hz: float | None) -> None:
        self._path, self._count = path, 0
        video = VideoFile(Path(path))
        self._frames, self._expected = video.frames(), video.expected
        rate = rate_hz if rate_hz is not None else video.rate_hz
        if not (math.isfinite(rate) and rate > 0):
            raise InputError(path, "the video does not state its frame rate", remedy="set camera.rate_hz")
        self._rate_hz = rate

    def read(self) -> tuple[float, NDArray[np.uint8]] | None:
        found = next(self._frames, None)
        if found is None:
            if self._count < 0.98 * self._expected - ESTIMATED:
                raise InputError(
                    self._path,
                    f"it can be read up to frame {self._count} of {self._expected}; it is damaged or was cut short",
                    remedy="record it again, or convert the part that can be read",
                )
            return None
        self._count += 1
        return (self._count - 1) / self._rate_hz, found[1]

    def close(self) -> None:
        self._frames.close()


class _Images:
    def __init__(self, path: str) -> None:
        self._path, self._row = path, 0
        try:
            with open(path, newline="", encoding="utf-8") as file:
                self._rows = list(csv.DictReader(file))
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise InputError(path, f"it cannot be read as a list of images ({_reason(error)})") from None
        missing = [name for name in COLUMNS if not self._rows or name not in self._rows[0]]
        if missing:
            raise InputError(
                path, f"it has no column '{missing[0]}'", remedy="a list of images has the columns file,t_s"
            )
        self._before = -math.inf

    def read(self) -> tuple[float, NDArray[np.uint8]] | None:
        if self._row >= len(self._rows):
            return None
        row, where = self._rows[self._row], f"row {self._row + 2}"
        self._row += 1
        try:
            t_s = float(row["t_s"] or "")
        except ValueError:
            t_s = math.nan
        if not math.isfinite(t_s):
            raise InputError(self._path, f"t_s is '{row['t_s']}', not a number of seconds", where=where)
        if t_s <= self._before:
            raise InputError(self._path, f"t_s is {t_s} after {self._before}; times must rise", where=where)
        self._before = t_s
        image = listed_file(Path(self._path), row["file"] or "", where)
        return t_s, read_image(image, where)

    def close(self) -> None:
        """Do nothing: nothing is held."""


def _reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else str(error)) or type(error).__name__
