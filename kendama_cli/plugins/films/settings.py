"""Settings of the detectors ``trained`` and ``network``."""

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


@dataclass(frozen=True)
class NetworkDetectorSettings:
    """A neural network that detects the ball: an ONNX file that OpenCV can run."""

    kind: Literal["network"]
    model: str = setting("File of the neural network (ONNX).", file=True)
    output: Literal["heatmap", "boxes"] = setting(
        "Output of the network. 'heatmap' is a probability per position (1, classes, h, w); 'boxes' has rows of "
        "centre, size and a probability per class (1, 4 + classes, n), as in Ultralytics' networks."
    )
    input_px: tuple[int, int] = setting("Width and height of the network's input [px].", at_least=16, at_most=4096)
    scale: float = setting("Images are scaled by this factor before detection; the rest of the input is grey.", above=0)
    class_number: int = setting("Number of the ball's class, counted from 0.", at_least=0)
    radius_px: float = setting("Radius of the ball in the image, for the detections of a heat map [px].", at_least=1.5)
    score_min: float = setting(
        "A detection counts from this probability on. A larger value misses more balls and reports fewer false ones.",
        above=0,
        below=1,
    )
    candidates: int = setting("Maximum number of candidates in an image.", at_least=1, at_most=20)
