"""Settings of the detectors ``trained`` and ``network``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class TrainedDetectorSettings:
    """A ball that was taught by boxes in a few images (``kendama camera train``)."""

    kind: Literal["trained"]
    ball: str = setting("file of the trained ball (npz)", file=True)
    balls: int = setting("maximum number of balls in an image: further peaks share their probability", at_least=1)
    score_min: float = setting("probability from which a peak counts as seen", above=0, below=1)
    candidates: int = setting("most candidates in an image", at_least=1, at_most=20)


@dataclass(frozen=True)
class NetworkDetectorSettings:
    """A ball that a neural network finds; the network is an ONNX file that OpenCV can run."""

    kind: Literal["network"]
    model: str = setting("file of the network (ONNX)", file=True)
    output: Literal["heatmap", "boxes"] = setting(
        "output: a probability per place (1, classes, h, w), or rows of middle, size and a probability per class "
        "(1, 4 + classes, n), as Ultralytics' networks have them"
    )
    input_px: tuple[int, int] = setting("width and height of its input [px]", at_least=16, at_most=4096)
    scale: float = setting("images are scaled by this before; what is then left of the input is grey", above=0)
    class_number: int = setting("number of the ball's class, from 0", at_least=0)
    radius_px: float = setting("the ball's radius in the image, of a heat map's sightings [px]", at_least=1.5)
    score_min: float = setting("probability from which a sighting counts as seen", above=0, below=1)
    candidates: int = setting("most candidates in an image", at_least=1, at_most=20)
