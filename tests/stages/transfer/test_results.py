"""Words on an imitation: the rollout that caught, and what is worth telling of the servo."""

from __future__ import annotations

import pytest

from kendama_cli.stages.transfer.results import imitation_words


@pytest.mark.parametrize(
    ("caught_at", "attempts", "lag_s", "sag_m", "words"),
    [
        (3, 3, 0.1, 0.029, "caught at the third rollout; the arm lags 0.1 s and sags 29 mm"),
        (1, 1, 0.004, 0.0009, "caught at the first rollout"),
        (None, 5, 0.06, 0.0, "not caught in 5 rollouts; the arm lags 0.06 s"),
        (None, 1, 0.0, 0.004, "not caught in 1 rollout; the arm sags 4 mm"),
        (12, 12, 0.0, 0.0, "caught at rollout 12"),
    ],
)
def test_the_words_tell_what_was_learned(
    caught_at: int | None, attempts: int, lag_s: float, sag_m: float, words: str
) -> None:
    assert imitation_words(caught_at, attempts, lag_s=lag_s, sag_m=sag_m) == words
