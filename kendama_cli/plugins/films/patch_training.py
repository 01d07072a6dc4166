"""A classifier of patches learned from training images, twice again from what it wrongly takes for the ball."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kendama_cli.plugins.films.ball_patches import Patches
from kendama_cli.plugins.films.patch_classifier import PatchClassifier, Training, Values, standardised
from kendama_cli.plugins.films.patch_features import COUNT, DIRECTIONS, turned

BALLS_A_BATCH, OTHERS_A_BATCH = 96, 192
TURNED = 0.5
"""The part of the batches that are shown turned or mirrored, balls and others alike."""
HARD_AN_IMAGE = 300
HARD_LOG_ODDS = -2.0


def trained(patches: Sequence[Patches], steps: int, rounds: int, rng: np.random.Generator) -> PatchClassifier:
    """Train a classifier by ``steps`` steps on ``patches``, of which some must show the ball.

    Between the ``rounds``, what the classifier takes for the ball elsewhere in these very images is added to what it
    learns as not the ball.
    """
    balls = np.concatenate([ball for one in patches for ball in one.balls])
    others = np.concatenate([other for one in patches for other in one.others])
    sample = np.concatenate([balls[:: max(len(balls) // 10_000, 1)], others])
    mean, spread = sample.mean(axis=0), sample.std(axis=0) + np.float32(1e-3)
    training = Training(mean, spread, steps, rng)
    shown, common = standardised(balls, mean, spread), standardised(others, mean, spread)
    hard = np.empty((0, COUNT), dtype=np.float32)
    orders = [turned(eighths, mirrored=mirrored) for eighths in range(DIRECTIONS) for mirrored in (False, True)]
    truth = np.repeat(np.array([1, 0], dtype=np.float32), [BALLS_A_BATCH, OTHERS_A_BATCH])
    for round_ in range(rounds):
        for _ in range(steps // rounds):
            batch = shown[rng.integers(0, len(shown), BALLS_A_BATCH)]
            from_hard = OTHERS_A_BATCH // 2 if len(hard) else 0
            some = common[rng.integers(0, len(common), OTHERS_A_BATCH - from_hard)]
            most = hard[rng.integers(0, max(len(hard), 1), from_hard)]
            batch = np.concatenate([batch, some, most])
            if rng.random() < TURNED:  # balls and others alike: else what is turned would be the ball
                batch = batch[:, orders[rng.integers(len(orders))]]
            training.learn(batch, truth)
        if round_ < rounds - 1:
            hard = np.concatenate([hard, standardised(_hard(training.classifier(), patches), mean, spread)])
    return training.classifier()


def _hard(classifier: PatchClassifier, patches: Sequence[Patches]) -> Values:
    """Return the features of patches elsewhere that look most like the ball."""
    found = []
    for one in patches:
        log_odds = classifier.log_odds(one.elsewhere)
        worst = np.argsort(-log_odds)[:HARD_AN_IMAGE]
        found.append(one.elsewhere[worst[log_odds[worst] > HARD_LOG_ODDS]])
    return np.concatenate(found)
