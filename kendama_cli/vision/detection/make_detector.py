"""Makes the detector that the configuration names."""

from __future__ import annotations

from kendama_cli.vision.detection.interface import Detector
from kendama_cli.vision.settings import DETECTORS, DetectorSettings


def make_detector(settings: DetectorSettings) -> Detector:
    """Make the detector that ``settings`` choose; raises InputError if a file of its own cannot be read."""
    made: Detector = DETECTORS.maker(settings.kind)(settings)
    return made
