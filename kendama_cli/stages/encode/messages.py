"""Messages that encode logs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from kendama_cli.schema.foxglove import FrameTransform


@dataclass(frozen=True)
class WeightsMessage:
    """The weights of one coordinate of one demonstration's primitive, over the phases of its basis functions."""

    demonstration: str
    coordinate: str
    centers: Collection[float]
    values: Collection[float]


TOPICS: Mapping[str, type] = {
    "/encode/demonstrated": FrameTransform,
    "/encode/own": FrameTransform,
    "/encode/reproduced": FrameTransform,
    "/encode/weights": WeightsMessage,
}
"""``demonstrated``: the recorded path; ``own``: its own primitive; ``reproduced``: the primitive that is given on."""
