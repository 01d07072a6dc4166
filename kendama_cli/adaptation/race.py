"""A race of motions for the largest expected success: the same drawn worlds for all, more of them for those ahead."""

from __future__ import annotations

from collections.abc import Sequence

from kendama_cli.adaptation.search_record import MotionVariation, Search, Trial
from kendama_cli.adaptation.uncertainty import BLOCK, expected_success, needed_m

ROUNDS = ((1, 3), (2, 2), (3, 1))
"""Blocks of worlds after each round, and how many candidates are in it: those ahead after the round before."""

MOST_DRAWS = BLOCK * ROUNDS[-1][0]

ENOUGH = 0.98
"""Expected success from which on a candidate needs no worlds of its own, and nothing but tau is changed."""


def draws_needed(candidates: int) -> int:
    """Rollouts that a race of so many takes at most."""
    return BLOCK * sum(min(candidates, entered) for _, entered in ROUNDS)


def next_draw(search: Search, candidates: Sequence[MotionVariation], mouth_m: float) -> Trial | None:
    """The next world that a candidate is judged in; None when the race of these has ended."""
    done, ahead, before = dict(search.evaluated), list(candidates), 0
    for blocks, entered in ROUNDS:
        if before:
            ahead = sorted(ahead, key=lambda one: _worth(search, one, mouth_m, before), reverse=True)
            ahead = [one for one in ahead if search.slack_in_swing(one) == search.slack_in_swing(ahead[0])]
            if min(len(ahead), entered) == 1 and expected_success(done[ahead[0]][:before], mouth_m) >= ENOUGH:
                return None
        ahead = ahead[:entered]
        for one in ahead:
            made = len(done.get(one, ()))
            if made < BLOCK * blocks:
                return Trial("evaluate", one, made)
        before = BLOCK * blocks
    return None


def winner(search: Search, candidates: Sequence[MotionVariation], mouth_m: float) -> MotionVariation:
    """The best of ``candidates``, any two of them compared by as many worlds as both were judged in.

    The one that was judged in fewest wins where it is the best by so many; or else those with so many are out.
    """
    done, left = dict(search.evaluated), list(candidates)
    while True:
        fewest = min(len(done[one]) for one in left)
        best = max(left, key=lambda one: _worth(search, one, mouth_m, fewest))
        longer = [one for one in left if len(done[one]) > fewest]
        if len(done[best]) == fewest or not longer:
            return best
        left = longer


def next_final_draw(search: Search, winners: Sequence[MotionVariation], mouth_m: float) -> Trial | None:
    """The next world for the best of the ``winners`` of several races, until it has stood as many as any of them."""
    if not winners:
        return None
    done = dict(search.evaluated)
    best, most = winner(search, winners, mouth_m), max(len(done[one]) for one in winners)
    return Trial("evaluate", best, len(done[best])) if len(done[best]) < most else None


def _worth(search: Search, one: MotionVariation, mouth_m: float, draws: int) -> tuple[bool, float, float]:
    """By its first ``draws`` worlds; what has a slack rope in its swing is worth less than anything that has none."""
    judged = dict(search.evaluated)[one][:draws]
    return not search.slack_in_swing(one), round(expected_success(judged, mouth_m), 3), -needed_m(judged)
