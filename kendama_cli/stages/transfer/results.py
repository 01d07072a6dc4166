"""Result, metrics and warnings of one transfer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.artifacts.proportion import Evaluation
from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.artifacts.transfer_result import TransferResult
from kendama_cli.control.settings import TransferSettings
from kendama_cli.identification.servo import servo_changed
from kendama_cli.schema.units import count_of
from kendama_cli.stages.interface import Metric
from kendama_cli.stages.transfer.progress import Progress


def transfer_result(
    progress: Progress,
    policy: PolicyArtifact | None,
    settings: TransferSettings,
    *,
    sag_m: float | None,
    known: ServoModel | None,
) -> tuple[TransferResult, Mapping[str, Metric]]:
    """Return what a transfer of ``policy``, if there was one, came to, and its metrics.

    Those of learning from scratch are among them if ``settings`` ask for it. ``sag_m`` is the servo's at the cup,
    ``known`` the one that was known before.
    """
    result = TransferResult(
        policy=None if policy is None else progress.kept(policy),
        rollouts=0 if policy is None else progress.rollouts(),
        imitation_caught=any(progress.imitation) if progress.imitation else None,
        games=len(progress.games),
        caught=sum(game.caught for game in progress.games),
    )
    learning = {} if policy is None else _learning(result, progress, baseline=settings.baseline)
    games = {} if policy is None else _games(result, progress, settings)
    imitation = _imitation(progress, settings, sag_m)
    found = progress.servo
    if found is not None and (known is None or servo_changed(known, found)) and (words := _servo_words(found, sag_m)):
        imitation["servo"] = words
    return result, {**imitation, **learning, **games, "missed_packets": progress.missed}


def warnings(progress: Progress, known: ServoModel | None) -> Iterator[str]:
    """Yield a sentence where the servo is not as ``known`` before, and one where learning made the table worse."""
    now = progress.servo
    if known is not None and now is not None and servo_changed(known, now):
        yield (
            f"the arm's servo changed: it follows {now.delay_s:.3f} s late, {known.delay_s:.3f} s when it was "
            "identified; commands lead by what was found now; identify it again with --force identify, or give this "
            "run's as transfer.servo"
        )
    if progress.after and progress.reverted():
        yield (
            f"learning on made the table worse: {sum(progress.after)} of {len(progress.after)} frozen rollouts succeed "
            f"after it, {sum(progress.before)} of {len(progress.before)} did before; the games were played with the "
            "table as it was before, which is also the result"
        )


def _learning(result: TransferResult, progress: Progress, *, baseline: bool) -> dict[str, Metric]:
    metrics: dict[str, Metric] = {"rollouts": result.rollouts, "learned": progress.learned()}
    if (solved := progress.solved()) is not None:
        metrics["rollouts_to_solved"] = progress.rollouts_to_solved()
        metrics["solved"] = solved
    if baseline:
        metrics["rollouts_from_scratch"] = progress.rollouts("scratch")
        metrics["learned_from_scratch"] = progress.learned("scratch")
    return metrics | {
        "success_rate_before": float(np.mean(progress.before)),
        "success_rate_after": float(np.mean(progress.after)),
        "reverted": progress.reverted(),
    }


def _imitation(progress: Progress, settings: TransferSettings, sag_m: float | None) -> dict[str, Metric]:
    attempts, servo = progress.imitation, progress.servo
    metrics: dict[str, Metric] = {"imitation_caught": None}
    if attempts:
        caught_at = attempts.index(True) + 1 if any(attempts) else None
        metrics = {
            "imitation": imitation_words(caught_at, len(attempts), _servo_words(servo, sag_m)),
            "imitation_caught": caught_at is not None,
            "imitation_caught_at": caught_at,
            "imitation_attempts": len(attempts),
            "imitation_caught_rate": None,  # below, with its interval
        }
    if servo is not None:
        metrics["servo_lag_s"] = float(np.median(servo.lag_s))
        metrics["servo_dead_time_s"] = servo.dead_time_s
        metrics["servo_sag_mm"] = None if sag_m is None else 1e3 * sag_m
    if progress.rope_fit is not None:
        metrics["imitation_rope_scale"] = progress.rope_fit.rope_scale
        metrics["imitation_resized"] = progress.rope_fit.resized
    if attempts:
        repeats = Evaluation(settings.imitation_repeats, settings.thorough)
        metrics["imitation_repeats"] = len(progress.repeats)
        metrics |= repeats.figures("imitation_caught_rate", sum(progress.repeats), len(progress.repeats))
    return metrics


ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")


def imitation_words(caught_at: int | None, attempts: int, servo: str) -> str:
    """Return the rollout at which the swing was caught, and the words on the ``servo``, if there are any."""
    if caught_at is None:
        caught = f"not caught in {count_of(attempts, 'rollout')} (transfer.imitation_attempts)"
    else:
        caught = f"caught at {f'the {ORDINALS[caught_at - 1]} rollout' if caught_at <= 10 else f'rollout {caught_at}'}"
    return caught + (f"; the arm {servo}" if servo else "")


def _servo_words(servo: ServoModel | None, sag_m: float | None) -> str:
    """Return the lag and sag of ``servo`` in words, empty where it has none that is worth a word."""
    lag_s = 0.0 if servo is None else float(np.median(servo.lag_s))
    words = [f"lags {lag_s:.2g} s"] if lag_s >= SHOWN_LAG_S else []
    words += [f"sags {1e3 * sag_m:.0f} mm"] if sag_m is not None and sag_m >= SHOWN_SAG_M else []
    return " and ".join(words)


SHOWN_LAG_S, SHOWN_SAG_M = 0.005, 0.001
"""A smaller lag and sag of the servo are not worth a word."""


def _games(result: TransferResult, progress: Progress, settings: TransferSettings) -> dict[str, Metric]:
    games = progress.games
    errors = [game.error_mm for game in games if game.error_mm is not None]
    latencies = [game.latency_frames for game in games if game.latency_frames is not None]
    frames = sum(game.frames for game in games)
    return {
        "games": result.games,
        **Evaluation(settings.games, settings.thorough).figures("caught_rate", result.caught, result.games),
        "swung_up_rate": float(np.mean([game.swung_up for game in games])),
        "prediction_error_mm_p50": float(np.median(errors)) if errors else None,
        "latency_frames_p95": max(latencies) if latencies else None,
        "detection_rate": sum(game.seen for game in games) / frames if frames else None,
    }
