"""The taught ball as a file, and the detector that goes by it."""

from __future__ import annotations

from pathlib import Path

from kendama_cli.errors import InputError
from kendama_cli.vision.settings import TaughtDetectorSettings
from kendama_cli.vision.taught_detector import TaughtDetector
from kendama_cli.vision.teaching import TaughtBall

REMEDY = "teach the ball with 'kendama camera train'"


def taught_detector(settings: TaughtDetectorSettings) -> TaughtDetector:
    """The detector of the ball that ``settings`` name; raises InputError for a file that holds none."""
    try:
        ball = TaughtBall.from_bytes(Path(settings.ball).read_bytes())
    except OSError as wrong:
        raise InputError(settings.ball, f"cannot be read ({wrong.strerror})", remedy=REMEDY) from None
    except ValueError as wrong:
        raise InputError(settings.ball, str(wrong), remedy=REMEDY) from None
    return TaughtDetector(settings, ball)
