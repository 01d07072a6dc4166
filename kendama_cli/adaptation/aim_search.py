"""Search for a catch by aiming: the motion is changed after each rollout by what its ball missed."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np

from kendama_cli.adaptation.aim import Aim, AimedRollout, AimPath, Miss, next_aim, observed_miss, path_of_motions
from kendama_cli.adaptation.catch_family import BUMPED, CatchFamily
from kendama_cli.adaptation.search_record import Attempt, MotionVariation, Search, Trial
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.learning.parameter_search import CmaSearch
from kendama_cli.schema.arrays import Array

IN_A_ROW = 3
"""So many catches in a row end the search."""
PROBE_M = 0.03
"""Shift of the goal in flight by which its effect on the miss is simulated."""
HALVINGS = 5
"""A shift that the arm's limits forbid is halved so often, then left out."""


class AimedMotions:
    """Motions of ``family`` that an aim chooses among, about that at ``tau`` and in the plane of the swing.

    ``simulate`` returns the attempt at a variation as modelled, its misses exact. About 180 motions are simulated.
    """

    def __init__(
        self,
        settings: AdaptSettings,
        family: CatchFamily,
        simulate: Callable[[MotionVariation], Attempt],
        tau: float,
    ) -> None:
        self._settings, self._family, self._tau = settings, family, tau
        policy = settings.policy
        dimension = 1 + len(BUMPED) * policy.bumps
        forward = simulate(self._bent(np.zeros(dimension))).forward

        def miss_m(parameters: Array) -> float | None:
            attempt = simulate(self._bent(parameters))
            return None if attempt.limit is not None else missed(attempt, forward)[0]

        misses, parameters, first_m = path_of_motions(miss_m, dimension)
        path = AimPath(tuple(misses), tuple(tuple(one.tolist()) for one in parameters), first_m, (-1.0, -1.0), forward)
        centred = self._bent(path.parameters_at(0.0))
        before = simulate(centred)
        self._flight = policy.goal_moves if before.flight is None else (before.flight[0], min(before.flight[1], 1.0))
        gains = []
        for axis, unit in enumerate(np.eye(2) * PROBE_M):
            after = simulate(self._shifted(centred, unit.tolist()))
            gains.append((missed(after, forward)[axis] - missed(before, forward)[axis]) / PROBE_M)
        self.path = dataclasses.replace(path, gain=(gains[0], gains[1]))

    def playable(self, aim: Aim) -> tuple[Aim, MotionVariation]:
        """Return ``aim`` with the goal's shift as large as the arm's limits allow, and its variation."""
        bent = self._bent(self.path.parameters_at(aim.along_m) + (aim.bent or 0.0))
        for halvings in range(HALVINGS):
            shift_m = (aim.shift_m[0] / 2**halvings, aim.shift_m[1] / 2**halvings)
            variation = self._shifted(bent, shift_m)
            if self._family.limit(variation) is None:
                return dataclasses.replace(aim, shift_m=shift_m), variation
        return dataclasses.replace(aim, shift_m=(0.0, 0.0)), bent

    def searched(self, aimed: Sequence[AimedRollout], costs_m: Sequence[float], seed: int) -> Aim:
        """Return the next motion of CMA-ES about the best of the rollouts that were ``aimed``, after these costs."""
        policy, best = self._settings.policy, min(aimed, key=lambda one: math.hypot(*one.miss_m)).aim
        complete, inside = divmod(len(costs_m), policy.generation)
        generations = np.reshape(costs_m[: len(costs_m) - inside], (complete, policy.generation))
        cma = CmaSearch(len(self.path.parameters[0]) + 2, policy.generation, seed)
        *bent, x, y = cma.after(generations.tolist()).proposals[inside].tolist()
        shift_m = (best.shift_m[0] + policy.spread_m * x, best.shift_m[1] + policy.spread_m * y)
        return Aim(best.along_m, shift_m, tuple(bent))

    def _bent(self, parameters: Array) -> MotionVariation:
        """Return the motion of log tau and bumps (d,) in their first standard deviations, slower where it has to be."""
        policy, (tau, *heights) = self._settings.policy, parameters.tolist()
        bent = MotionVariation(
            self._tau * math.exp(policy.spread_tau * tau), bumps_m=tuple(policy.spread_m * one for one in heights)
        )
        return self._family.within_limits(bent, self._settings.tau_range)

    def _shifted(self, bent: MotionVariation, shift_m: Sequence[float]) -> MotionVariation:
        x, y = shift_m
        return dataclasses.replace(bent, shift_m=(x, y), flight=self._flight) if (x, y) != (0.0, 0.0) else bent


class AimSearch:
    """Rollouts in the perturbed simulations, each aimed by the misses of those before; CMA-ES where aiming fails."""

    def __init__(self, settings: AdaptSettings, motions: AimedMotions, seed: int, *, mouth_m: float) -> None:
        """Take the ``seed`` of CMA-ES."""
        self._settings, self._motions, self._seed, self._mouth_m = settings, motions, seed, mouth_m

    def next_trial(self, search: Search) -> Trial | None:
        """Return the next trial, or None if the search has ended: repeats that confirm come last."""
        attempts = search.attempts
        if _in_a_row(attempts) < IN_A_ROW and len(attempts) < self._settings.policy.max_rollouts:
            return Trial("explore", self._next(attempts), len(attempts), len(attempts))
        best = self.best(search)
        return None if best is None else search.next_confirmation(best, self._settings.evaluation)

    def rollouts(self, search: Search) -> int:
        """Return the number of rollouts of the search; the repeats that confirm are no part of it."""
        return sum(one.limit is None for one in search.attempts)

    def best(self, search: Search) -> MotionVariation | None:
        """Return the newest motion that caught, or None if there is none."""
        return next((one.variation for one in reversed(search.attempts) if one.caught), None)

    def expected(self, search: Search, variation: MotionVariation) -> float:
        """Return the fraction of the rollouts of a motion that were caught."""
        made = [one.caught for one in search.attempts if one.variation == variation]
        return sum(made) / len(made)

    def _next(self, attempts: Sequence[Attempt]) -> MotionVariation:
        """Return the motion to play after ``attempts``; what the search has caught comes again while it catches."""
        rollouts: list[AimedRollout] = []
        forward = self._motions.path.forward
        while (aim := next_aim(self._motions.path, rollouts, self._mouth_m)) is not None:
            aim, variation = self._motions.playable(aim)
            if len(rollouts) == len(attempts):
                return variation
            attempt = attempts[len(rollouts)]
            rollouts.append(AimedRollout(aim, attempt.caught, missed(attempt, forward)))
        searched = attempts[len(rollouts) :]
        if searched and searched[-1].caught:
            return searched[-1].variation
        costs_m = {one.variation: math.hypot(*missed(one, forward)) for one in searched}
        return self._motions.playable(self._motions.searched(rollouts, list(costs_m.values()), self._seed))[1]


def missed(attempt: Attempt, forward: float) -> Miss:
    """Return the miss of ``attempt``, whose ball should have flown along x (``forward`` 1) or against it (-1)."""
    miss_m = None if attempt.signed_miss_m is None else (attempt.signed_miss_m, attempt.side_miss_m or 0.0)
    return observed_miss(miss_m, attempt.apex_m, forward)


def _in_a_row(attempts: Sequence[Attempt]) -> int:
    return next((k for k, one in enumerate(reversed(attempts)) if not one.caught), len(attempts))
