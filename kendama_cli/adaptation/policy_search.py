"""The search of a motion's shape: which rollout comes next, as a function of those already made."""

from __future__ import annotations

import math

from kendama_cli.adaptation.catch_family import CatchFamily
from kendama_cli.adaptation.path_bumps import ALONG
from kendama_cli.adaptation.search_record import Attempt, MotionVariation, Search, Trial
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.adaptation.uncertainty import Repeat
from kendama_cli.learning.parameter_search import Generation, parameter_search
from kendama_cli.physics.rim_crossing import SLACK_S
from kendama_cli.schema.arrays import Array

NEVER_DOWN_M = 0.6
"""What a ball costs that never came down through the rim's plane, less the height to which it rose."""
HIGHEST_M = 0.3
"""A ball that rose higher than this is not preferred for it."""
FORBIDDEN_M = 1.5
"""What a motion costs that the arm cannot do."""
JUMPED_OUT_M = 0.04
"""What a ball costs at least that was lost: as much as one that came down on the edge of the cup."""
SLACK_M = 0.06
"""How far apart a rope without mass and a chain come down after a slack in mid-swing (60 to 80 mm)."""
MOST_FORBIDDEN = 3
"""A search in which all but one of so many motions are beyond the arm's limits ends early."""


class PolicySearch:
    """Generations of rollouts of a policy of few parameters, each followed by repeats that judge what it learned.

    The parameters are log tau, the bumps' heights and the goal's place along x and y, in units of their first spread
    and zero for the motion as it is. All rollouts of a generation are played in one world (common random numbers), the
    repeats in fresh ones; those do not count.
    """

    def __init__(self, settings: AdaptSettings, family: CatchFamily, seed: int) -> None:
        if settings.search == "tau":
            raise ValueError("a policy search is one of cma, power and random")
        self._settings, self._policy, self._family = settings, settings.policy, family
        policy = settings.policy
        self._parameters = parameter_search(
            settings.search,
            1 + len(ALONG) * policy.bumps + 2,
            seed,
            generation=policy.generation,
            elite=policy.elite,
            reward_cost=policy.reward_m,
        )

    def next_trial(self, search: Search) -> Trial | None:
        """The next rollout to play, or None when the search has ended: repeats that confirm come last."""
        if self.proven(search) is None:
            complete, inside = divmod(len(search.attempts), self._policy.generation)
            stand = self._stand(search, complete)
            if inside == 0 and complete:
                judged = self._variation(stand.best)
                made = dict(search.evaluated).get(judged, ())
                allowed = self._family.limit(judged) is None and search.reaching([judged])
                if allowed and not self._decided(made):
                    return Trial("prove", judged, len(made))
            most = self._policy.max_rollouts
            if self.rollouts(search) < most and len(search.attempts) < MOST_FORBIDDEN * most:
                return Trial("explore", self._variation(stand.proposals[inside]), len(search.attempts))
        best = self.best(search)
        if best is not None and len(search.confirmed) < self._settings.repeats:
            return Trial("confirm", best, len(search.confirmed))
        if best is None and search.short_of_reach:  # what the newest of them would be worth is told
            judged = search.short_of_reach[-1][0]
            made = dict(search.evaluated).get(judged, ())
            return None if self._decided(made) else Trial("prove", judged, len(made))
        return None

    def expected(self, search: Search, variation: MotionVariation) -> float:
        """The success that is expected of a motion that was judged: the share of its repeats that was caught."""
        made = dict(search.evaluated)[variation]
        return _caught(made) / len(made)

    def rollouts(self, search: Search) -> int:
        """How many rollouts the search took, without the repeats that judged it."""
        return sum(one.limit is None for one in search.attempts)

    def proven(self, search: Search) -> MotionVariation | None:
        """The policy of which enough repeats were caught, without a rope that hangs slack in the swing."""
        enough, of = self._policy.stop_at
        done = dict(search.evaluated)
        for variation in search.reaching(done):
            made = done[variation]
            if len(made) == of and _caught(made) >= enough and not _slack(made):
                return variation
        return None

    def best(self, search: Search) -> MotionVariation | None:
        """The proven policy, or else the one of which most repeats were caught before it was given up.

        One whose rope hangs slack in the swing is taken only where there is no other.
        """
        proven, done = self.proven(search), dict(search.evaluated)
        caught = [one for one in search.reaching(done) if _caught(done[one])]
        return proven or max(caught, key=lambda one: (not _slack(done[one]), _caught(done[one])), default=None)

    def _decided(self, made: tuple[Repeat, ...]) -> bool:
        enough, of = self._policy.stop_at
        return len(made) == of or len(made) - _caught(made) > of - enough

    def _stand(self, search: Search, complete: int) -> Generation:
        n = self._policy.generation
        costs = [cost_m(one) for one in search.attempts[: n * complete]]
        return self._parameters.after([costs[n * g : n * g + n] for g in range(complete)])

    def _variation(self, parameters: Array) -> MotionVariation:
        """The motion of these ``parameters`` (d,), slower where the arm's limits ask for it."""
        policy, (tau, *rest) = self._policy, parameters.tolist()
        *heights, x, y = (policy.spread_m * one for one in rest)
        wanted = MotionVariation(
            self._settings.tau_start * math.exp(policy.spread_tau * tau),
            shift_m=(x, y),
            flight=policy.goal_moves,
            bumps_m=tuple(heights),
        )
        return self._family.within_limits(wanted, self._settings.tau_range)


def cost_m(attempt: Attempt) -> float:
    """What a rollout costs [m]: how far the ball came down from where the cup was planned to be.

    A seen catch's own way counts as a miss would, so that its search ends where little of it is needed. A rope that
    hung slack in the swing costs SLACK_M besides.
    """
    if attempt.limit is not None:
        return FORBIDDEN_M
    if attempt.signed_miss_m is None:
        return NEVER_DOWN_M - min(attempt.apex_m, HIGHEST_M)
    missed = attempt.off_m + attempt.steered_m + (SLACK_M if attempt.slack_in_swing else 0.0)
    return missed if attempt.caught else max(missed, JUMPED_OUT_M)


def _slack(made: tuple[Repeat, ...]) -> bool:
    """Whether the rope hung slack in the swing of most of these repeats."""
    return sum(one.swing_slack_s >= SLACK_S for one in made) > len(made) / 2


def _caught(made: tuple[Repeat, ...]) -> int:
    return sum(one.caught for one in made)
