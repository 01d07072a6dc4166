"""Search for the motion's shape: generations of rollouts, each followed by repeats that validate what was learned."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from kendama_cli.adaptation.catch_family import BUMPED, CatchFamily
from kendama_cli.adaptation.search_record import Attempt, MotionVariation, Repeat, Search, Trial
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.learning.parameter_search import Generation, parameter_search
from kendama_cli.physics.rim_crossing import SLACK_S
from kendama_cli.schema.arrays import Array

NEVER_DOWN_M = 0.6
"""Cost of a ball that never came down through the rim's plane, less the height to which it rose."""
HIGHEST_M = 0.3
"""A ball that rose higher than this is not preferred for it."""
FORBIDDEN_M = 1.5
"""Cost of a motion that the arm cannot do."""
JUMPED_OUT_M = 0.04
"""Least cost of a ball that was lost: as much as of one that came down on the edge of the cup."""
SLACK_M = 0.06
"""Distance at which a rope without mass and a chain come down after a slack in mid-swing (60 to 80 mm)."""
MAX_FORBIDDEN = 3
"""A search in which all but one of so many motions are beyond the arm's limits ends early."""


class PolicySearch:
    """Generations of rollouts of a policy of few parameters, each followed by repeats that validate it.

    The parameters are log tau, the bumps' heights and the goal's place along x and y, in units of their first spread
    and zero for the motion as it is. All rollouts of a generation share one perturbed simulation (common random
    numbers), the repeats are in fresh ones; those do not count.
    """

    def __init__(
        self, settings: AdaptSettings, family: CatchFamily, seed: int, method: Literal["cma", "power", "random"]
    ) -> None:
        self._settings, self._policy, self._family = settings, settings.policy, family
        policy = settings.policy
        self._parameters = parameter_search(
            method,
            1 + len(BUMPED) * policy.bumps + 2,
            seed,
            generation=policy.generation,
            elite=policy.elite,
            reward_cost=policy.reward_m,
        )

    def next_trial(self, search: Search) -> Trial | None:
        """Return the next trial, or None if the search has ended: repeats that confirm come last."""
        if self.solved(search) is None:
            complete, inside = divmod(len(search.attempts), self._policy.generation)
            generation = self._generation(search, complete)
            if inside == 0 and complete:
                learned = self._variation(generation.best)
                if self._family.limit(learned) is None and search.reaching([learned]):
                    trial = self._next_repeat(search, learned)
                    if trial is not None:
                        return trial
            maximum = self._policy.max_rollouts
            if self.rollouts(search) < maximum and len(search.attempts) < MAX_FORBIDDEN * maximum:
                proposal = self._variation(generation.proposals[inside])
                return Trial("explore", proposal, len(search.attempts), complete)
        best = self.best(search)
        if best is not None:
            return search.next_confirmation(best, self._settings.evaluation)
        if search.short_of_reach:  # what the newest of them would be worth is reported
            return self._next_repeat(search, search.short_of_reach[-1][0])
        return None

    def expected(self, search: Search, variation: MotionVariation) -> float:
        """Return the fraction of the repeats of an evaluated motion that were caught."""
        repeats = search.simulations.repeats(variation)
        return _caught(repeats) / len(repeats)

    def rollouts(self, search: Search) -> int:
        """Return the number of rollouts of the search, without the repeats that validated it."""
        return sum(one.limit is None for one in search.attempts)

    def solved(self, search: Search) -> MotionVariation | None:
        """Return the policy of which enough repeats were caught, without a rope that hangs slack in the swing."""
        enough, of = self._policy.stop_at
        for variation in search.evaluated_reaching():
            repeats = search.simulations.repeats(variation)
            if len(repeats) == of and _caught(repeats) >= enough and not _slack(repeats):
                return variation
        return None

    def best(self, search: Search) -> MotionVariation | None:
        """Return the solved policy, or else the one of which most repeats were caught before it was given up.

        One whose rope hangs slack in the swing is taken only if there is no other.
        """
        repeats = search.simulations.repeats
        caught = [one for one in search.evaluated_reaching() if _caught(repeats(one))]
        best = max(caught, key=lambda one: (not _slack(repeats(one)), _caught(repeats(one))), default=None)
        return self.solved(search) or best

    def _next_repeat(self, search: Search, variation: MotionVariation) -> Trial | None:
        """Return the next repeat that validates ``variation``; None if it is decided."""
        enough, of = self._policy.stop_at
        repeats = search.simulations.repeats(variation)
        if len(repeats) == of or len(repeats) - _caught(repeats) > of - enough:
            return None
        return Trial("validate", variation, len(repeats), len(search.attempts))

    def _generation(self, search: Search, complete: int) -> Generation:
        n = self._policy.generation
        costs = [cost_m(one) for one in search.attempts[: n * complete]]
        return self._parameters.after([costs[n * g : n * g + n] for g in range(complete)])

    def _variation(self, parameters: Array) -> MotionVariation:
        """Return the motion of these ``parameters`` (d,), slower if the arm's limits ask for it."""
        policy, (tau, *rest) = self._policy, parameters.tolist()
        *heights, x, y = (policy.spread_m * one for one in rest)
        proposed = MotionVariation(
            self._settings.tau_start * math.exp(policy.spread_tau * tau),
            shift_m=(x, y),
            flight=policy.goal_moves,
            bumps_m=tuple(heights),
        )
        return self._family.within_limits(proposed, self._settings.tau_range)


def cost_m(attempt: Attempt) -> float:
    """Return the cost of a rollout [m]: the distance from the cup's planned position at which the ball came down.

    The path of a visual catch counts as a miss would, so that its search ends where little of it is needed. A rope that
    hung slack in the swing costs SLACK_M besides.
    """
    if attempt.limit is not None:
        return FORBIDDEN_M
    if attempt.signed_miss_m is None:
        return NEVER_DOWN_M - min(attempt.apex_m, HIGHEST_M)
    missed = attempt.distance_m + attempt.correction_m + (SLACK_M if attempt.slack_in_swing else 0.0)
    return missed if attempt.caught else max(missed, JUMPED_OUT_M)


def _slack(repeats: Sequence[Repeat]) -> bool:
    """Return True if the rope hung slack in the swing of most of these repeats."""
    return sum(one.swing_slack_s >= SLACK_S for one in repeats) > len(repeats) / 2


def _caught(repeats: Sequence[Repeat]) -> int:
    return sum(one.caught for one in repeats)
