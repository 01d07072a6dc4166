"""The detector ``network``: its file, and what is wrong with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.plugins.films.network_detector import NetworkDetector
from kendama_cli.plugins.films.settings import NetworkDetectorSettings

SHAPES = {"heatmap": "(1, classes, h, w)", "boxes": "(1, 4 + classes, n) or (1, n, 4 + classes)"}
REMEDY = "examples/train_network.py makes one; docs/plugins/films.md says what fits"


def network_detector(settings: NetworkDetectorSettings) -> NetworkDetector:
    """Make the detector of the network that ``settings`` name; raises InputError for a file without one that fits."""
    try:
        content = Path(settings.model).read_bytes()
    except OSError as wrong:
        raise InputError(settings.model, f"cannot be read ({wrong.strerror})", remedy=REMEDY) from None
    logging: Any = getattr(cv2.utils, "logging", cv2)  # OpenCV 4.10 has the same two functions elsewhere
    loud = logging.getLogLevel()
    logging.setLogLevel(0)
    try:
        network = cv2.dnn.readNetFromONNX(np.frombuffer(content, dtype=np.uint8))
        if network.empty():
            raise ValueError("no layers")
    except (cv2.error, ValueError):
        raise InputError(settings.model, "it is not a network in ONNX that OpenCV can read", remedy=REMEDY) from None
    finally:
        logging.setLogLevel(loud)
    detector = NetworkDetector(settings, network)
    width, height = settings.input_px
    try:
        made = detector.output(np.zeros((2, 2, 3), dtype=np.uint8))
    except cv2.error:
        raise InputError(
            settings.model,
            f"it does not take an image of {width} x {height} px (1, 3, {height}, {width})",
            remedy="set predict.detector.input_px to the size that it was exported with",
        ) from None
    if not detector.fits(made):
        raise InputError(
            settings.model,
            f"its output has the shape {tuple(made.shape)}; of output={settings.output} with class_number="
            f"{settings.class_number} it is {SHAPES[settings.output]}",
            remedy="set predict.detector.output and class_number as the network needs them",
        )
    return detector
