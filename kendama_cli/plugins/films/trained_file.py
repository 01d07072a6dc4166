"""The trained ball as a file, and the detector that goes by it."""

from __future__ import annotations

from pathlib import Path

from kendama_cli.errors import InputError
from kendama_cli.plugins.films.settings import TrainedDetectorSettings
from kendama_cli.plugins.films.trained_detector import TrainedDetector
from kendama_cli.plugins.films.training import TrainedBall

REMEDY = "teach the ball with 'kendama camera train'"


def trained_detector(settings: TrainedDetectorSettings) -> TrainedDetector:
    """Make the detector of the ball that ``settings`` name; raises InputError for a file that holds none."""
    try:
        ball = TrainedBall.from_bytes(Path(settings.ball).read_bytes())
    except OSError as wrong:
        raise InputError(settings.ball, f"cannot be read ({wrong.strerror})", remedy=REMEDY) from None
    except ValueError as wrong:
        raise InputError(settings.ball, str(wrong), remedy=REMEDY) from None
    return TrainedDetector(settings, ball)
