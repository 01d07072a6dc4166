"""The metrics of transfer."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kendama_cli.artifacts.transfer_result import TransferResult
from kendama_cli.game.transfer_progress import Progress
from kendama_cli.stages.interface import Metric


def transfer_metrics(result: TransferResult, progress: Progress, *, baseline: bool) -> Mapping[str, Metric]:
    """All figures of one transfer; those of learning from scratch where ``baseline`` asked for it."""
    games = progress.games
    errors = [game.error_mm for game in games if game.error_mm is not None]
    latencies = [game.latency_frames for game in games if game.latency_frames is not None]
    frames = sum(game.frames for game in games)
    metrics: dict[str, Metric] = {"rollouts": result.rollouts, "learned": progress.learned()}
    if (proven := progress.proven()) is not None:
        metrics["rollouts_to_proof"] = progress.rollouts_to_proof()
        metrics["proven"] = proven
    if baseline:
        metrics["rollouts_from_scratch"] = progress.rollouts("scratch")
        metrics["learned_from_scratch"] = progress.learned("scratch")
    metrics |= {
        "success_rate_before": float(np.mean(progress.before)),
        "success_rate_after": float(np.mean(progress.after)),
        "went_back": progress.went_back(),
        "imitation_caught": result.imitation_caught,
        "imitation_tries": len(progress.imitation),
    }
    if progress.imitation:
        metrics["imitation_caught_rate"] = float(np.mean(progress.repeats)) if progress.repeats else None
    if progress.rope_fit is not None:
        metrics["imitation_rope_scale"] = progress.rope_fit.rope_scale
        metrics["imitation_resized"] = progress.rope_fit.resized
    return metrics | {
        "games": result.games,
        "caught_rate": result.caught / result.games,
        "swung_up_rate": float(np.mean([game.swung_up for game in games])),
        "prediction_error_mm_p50": float(np.median(errors)) if errors else None,
        "latency_frames_p95": max(latencies) if latencies else None,
        "seen_rate": sum(game.seen for game in games) / frames if frames else None,
        "missed_packets": progress.missed,
    }
