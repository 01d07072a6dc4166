"""The ball's learned colour as a file, and the detector that goes by it."""

from __future__ import annotations

from pathlib import Path

from kendama_cli.errors import InputError
from kendama_cli.vision.detection.colour import LearnedColour
from kendama_cli.vision.detection.colour_detector import ColourDetector
from kendama_cli.vision.settings import ColourDetectorSettings

REMEDY = "learn the colour again, or set predict.detector.colour=null to go by its thresholds"


def colour_detector(settings: ColourDetectorSettings) -> ColourDetector:
    """Make the detector with the learned colour if ``settings`` name one, else with their thresholds."""
    return ColourDetector(settings, None if settings.colour is None else read_colour(settings.colour))


def read_colour(path: str) -> LearnedColour:
    """Read the colour model; raises InputError for a file that is not there or holds none."""
    try:
        return LearnedColour.from_json(Path(path).read_text(encoding="utf-8"))
    except OSError as wrong:
        raise InputError(path, f"cannot be read ({wrong.strerror})", remedy=REMEDY) from None
    except ValueError as wrong:
        raise InputError(path, str(wrong), remedy=REMEDY) from None
