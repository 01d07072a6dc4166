"""What metrics and checkpoints keep of each game, and of how the imitation was fitted."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.control.catch_game import Game


@dataclass(frozen=True)
class GameFigures:
    """One game; None where there was nothing to measure. ``frames`` counts images, ``seen`` those with the ball."""

    swung_up: bool
    caught: bool
    error_mm: float | None
    """Of the crossing that was predicted some time before it."""
    frames: int
    seen: int
    latency_frames: float | None

    @staticmethod
    def of(game: Game, horizon_s: float) -> GameFigures:
        """The figures of ``game``, its prediction taken ``horizon_s`` before the crossing."""
        error_m, observed = game.prediction_error_m(horizon_s), game.observed
        return GameFigures(
            swung_up=game.swung_up,
            caught=game.caught,
            error_mm=None if error_m is None else 1e3 * error_m,
            frames=len(observed.frames),
            seen=observed.seen,
            latency_frames=observed.latency_frames,
        )


@dataclass(frozen=True)
class RopeFitFigures:
    """How the imitation was fitted: the real rope's length over the model's, and whether the arm follows that."""

    rope_scale: float
    resized: bool
