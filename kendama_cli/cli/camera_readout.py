"""Readouts of rolling shutters found by ``camera track``: a calibration with them, and what is said of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.errors import InputError, UsageError
from kendama_cli.schema.plain_yaml import load_yaml
from kendama_cli.vision.ball_film import FilmTrack
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.readout import FoundReadout, find_readout

NOTE = "# Made by 'kendama camera track --readout'; use it with --calibration, or camera.calibration=FILE\n"


@dataclass(frozen=True)
class Readouts:
    """The cameras with the readouts that were found, where they were."""

    cameras: list[CameraModel]
    found: FoundReadout

    def lines(self) -> Iterator[str]:
        """One about each camera."""
        by = f"by {self.found.flights} flight{'' if self.found.flights == 1 else 's'}"
        for camera, own, half, setting in zip(
            self.cameras, self.found.readout_s, self.found.half_s, self.found.settings_s, strict=True
        ):
            told = f"{1e3 * own:.1f} +-{1e3 * half:.1f} ms (95 %), {by}"
            if setting is None:
                yield (
                    f"{camera.name}: its readout cannot be told ({told}), and stays {1e3 * camera.readout_s:g} ms; "
                    "film more flights, higher ones, with a second camera"
                )
            elif setting == 0:
                yield f"{camera.name}: as of a global shutter, its readout is {told}"
            else:
                yield f"{camera.name}: a rolling shutter, its readout is {told}"

    def document(self) -> dict[str, Any]:
        """The same by camera, for a program."""
        return {
            camera.name: {
                "readout_s": float(own),
                "interval_s": [float(own - half), float(own + half)],
                "set_s": setting,
            }
            for camera, own, half, setting in zip(
                self.cameras, self.found.readout_s, self.found.half_s, self.found.settings_s, strict=True
            )
        }


def refuse_readout(output: Path | None, calibration: Path | None) -> None:
    """Raise UsageError where ``--readout`` cannot be done or written."""
    if output is None:
        return
    if calibration is None:
        raise UsageError("--readout: flights tell it in metres; add --calibration (see 'kendama camera calibrate')")
    refuse_output(output, "a calibration is YAML", ".yaml", ".yml", option="--readout")


def find_readouts(
    tracks: Sequence[FilmTrack], cameras: Sequence[CameraModel], *, same_clock: bool, ball_radius_m: float | None
) -> Readouts:
    """The readouts from the flights in ``tracks``; InputError where they show none."""
    try:
        found = find_readout(tracks, cameras, same_clock=same_clock, ball_radius_m=ball_radius_m)
    except ValueError as wrong:
        raise InputError(
            "--readout", str(wrong), remedy="leave out --readout, or film a ball that is thrown up and falls"
        ) from None
    kept = [
        camera if setting is None else replace(camera, readout_s=setting)
        for camera, setting in zip(cameras, found.settings_s, strict=True)
    ]
    return Readouts(kept, found)


def write_readouts(calibration: Path, output: Path, cameras: Sequence[CameraModel]) -> None:
    """``calibration`` again, with the readouts of ``cameras``. Raises StoreError where the disk refuses."""
    content = load_yaml(calibration.read_text(encoding="utf-8"))
    readouts = {camera.name: camera.readout_s for camera in cameras}
    for entry in content["cameras"]:
        if entry["name"] in readouts:
            entry["readout_s"] = round(readouts[entry["name"]], 6)
    write_output(output, (NOTE + yaml.safe_dump(content, sort_keys=False)).encode(), option="--readout")
