"""Brightness of each image of a camera, with its stamp: live, from a film with stamps, or from a table of both."""

from __future__ import annotations

import dataclasses
import math
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kendama_cli.devices.camera.interface import StaleFrame, open_cameras
from kendama_cli.errors import ConfigError, InputError, UsageError
from kendama_cli.plugins.calibration.csv_rows import csv_rows
from kendama_cli.plugins.shared.videos.video import VideoFile
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import CameraSettings, DeviceCamera
from kendama_cli.vision.cameras.region import Region, whole
from kendama_cli.vision.detection.interface import Image

POLL_S = 0.001
SILENCE_S = 2.0


@dataclass(frozen=True)
class Brightness:
    """Mean of all pixels and colours of each image (n,), and when it came (n,) [s]."""

    stamp_s: Array
    level: Array


def watch(settings: CameraSettings, seconds: float, region: Region | None) -> Brightness:
    """Watch the first live camera for ``seconds``; stamps are of arrival, on the machine's clock (Unix time).

    Raises ConfigError for a camera that is not live, MissingPartError where it is not there, StaleFrame.
    """
    if not isinstance(settings, DeviceCamera):
        raise ConfigError("camera", f"'camera' is '{settings.kind}'; only a live camera has a delay: camera=device")
    alone = dataclasses.replace(
        settings,
        latency_s=0.0,
        cameras=settings.cameras[:1],
        indices=settings.indices[:1],
        addresses=settings.addresses[:1],
        calibration=None,
    )
    (camera,) = open_cameras(alone, time.time, None)
    stamps: list[float] = []
    levels: list[float] = []
    try:
        end_s = time.time() + seconds
        while time.time() < end_s:
            frame = camera.latest(max_age_s=SILENCE_S)
            if not stamps or frame.t_s > stamps[-1]:
                stamps.append(frame.t_s)
                levels.append(_level(frame.pixels, region))
            time.sleep(POLL_S)
    except StaleFrame:
        if not stamps:
            raise
    finally:
        camera.close()
    return Brightness(np.array(stamps), np.array(levels))


def of_film(film: Path, stamps: Path, region: Region | None) -> Brightness:
    """Read the frames of a film, with stamps from a table's column ``t_s``; raises InputError if the counts differ."""
    stamp_s = read_column(stamps, "t_s")
    levels = np.array([_level(pixels, region) for _, pixels in VideoFile(film).frames()])
    if len(levels) != len(stamp_s):
        raise InputError(
            str(stamps),
            f"it has {len(stamp_s)} stamps, and the film {len(levels)} frames",
            remedy="write one stamp for each frame that is kept",
        )
    return Brightness(stamp_s, levels)


def of_table(table: Path) -> Brightness:
    """Read the columns ``t_s`` and ``brightness``; raises InputError for a file without them."""
    return Brightness(read_column(table, "t_s"), read_column(table, "brightness"))


def read_column(path: Path, name: str) -> Array:
    """Read one column of numbers; raises InputError if it is missing or a value is no number."""
    remedy, values = f"give CSV with a column {name}", []
    for number, row in enumerate(csv_rows(path, remedy), start=2):
        try:
            value = float(row[name])
        except (KeyError, TypeError, ValueError):
            value = math.nan
        if not math.isfinite(value):
            told = f"line {number} has no number '{name}'" if name in row else f"it has no column '{name}'"
            raise InputError(str(path), told, remedy=remedy)
        values.append(value)
    if not values or (name == "t_s" and (np.diff(values) <= 0).any()):
        raise InputError(str(path), f"'{name}' does not rise, or is empty", remedy="times rise from line to line")
    return np.array(values)


def _level(pixels: Image, region: Region | None) -> float:
    if region is not None:
        height, width = pixels.shape[:2]
        if region.within(whole(width, height)) != region:
            raise UsageError(f"--region reaches beyond the image of {width} x {height} px")
        pixels = pixels[region.top : region.bottom, region.left : region.right]
    return float(pixels.mean())
