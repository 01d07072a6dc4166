"""Words on an imitation: the rollout that caught, what is worth telling of the servo, and what a later run may take."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.stages.transfer.progress import Progress
from kendama_cli.stages.transfer.results import imitation_words, transfer_result
from tests.control.test_games import LEARN, TRANSFER


def servo(lag_s: float) -> ServoModel:
    return ServoModel(("a",), 0.0, *(np.array([k]) for k in (lag_s, 1e-4, 0.0, 0.0)))


@pytest.mark.parametrize(
    ("caught_at", "attempts", "servo", "words"),
    [
        (3, 3, "lags 0.1 s", "caught at the third rollout; the arm lags 0.1 s"),
        (1, 1, "", "caught at the first rollout"),
        (None, 5, "", "not caught in 5 rollouts (transfer.imitation_attempts)"),
        (None, 1, "sags 4 mm", "not caught in 1 rollout (transfer.imitation_attempts); the arm sags 4 mm"),
        (12, 12, "", "caught at rollout 12"),
    ],
)
def test_the_words_tell_what_was_learned(caught_at: int | None, attempts: int, servo: str, words: str) -> None:
    assert imitation_words(caught_at, attempts, servo) == words


@pytest.mark.parametrize(
    ("known", "found", "sag_m", "told"),
    [
        (None, servo(0.1), 0.029, "lags 0.1 s and sags 29 mm"),
        (None, servo(0.004), 0.0009, None),
        (None, servo(0.0), 0.004, "sags 4 mm"),
        (servo(0.1), servo(0.102), 0.0, None),
        (servo(0.1), servo(0.06), None, "lags 0.06 s"),
        (servo(0.1), None, None, None),
        (None, None, None, None),
    ],
)
def test_a_servo_is_offered_to_later_runs_where_it_was_not_known_before(
    known: ServoModel | None, found: ServoModel | None, sag_m: float | None, told: str | None
) -> None:
    progress = Progress.resumed(None, None, LEARN, TRANSFER, np.random.default_rng(1))
    progress.servo = found
    _, metrics = transfer_result(progress, None, TRANSFER, sag_m=sag_m, known=known)
    assert metrics.get("servo") == told
