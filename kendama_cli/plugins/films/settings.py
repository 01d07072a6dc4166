"""Settings of the detector ``trained``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class TrainedDetectorSettings:
    """A detector that was trained on boxes in a few images (``kendama camera train``)."""

    kind: Literal["trained"]
    ball: str = setting("File of the trained detector (npz), made by 'kendama camera train'.", file=True)
    balls: int = setting(
        "Maximum number of balls in an image. Detections beyond it share their probability.", at_least=1
    )
    score_min: float = setting(
        "A peak counts as a detection from this probability on. A larger value misses more balls and reports fewer "
        "false ones.",
        above=0,
        below=1,
    )
    candidates: int = setting("Maximum number of candidates in an image.", at_least=1, at_most=20)
