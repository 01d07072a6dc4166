"""One tracked body or marker as a file holds it, before its axes are ours."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class BodyTrack:
    """``t_s`` (n,), ``position_m`` (n, 3) in the file's axes, NaN where it was not seen.

    ``rotation_wxyz`` (n, 4) turns the body's axes into the file's; None for a single marker.
    """

    name: str
    t_s: Array
    position_m: Array
    rotation_wxyz: Array | None
