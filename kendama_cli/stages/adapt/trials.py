"""Playing what a search asks for: which world each of its trials is played in, and what of it is logged."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kendama_cli.adaptation.policy_search import cost_m
from kendama_cli.adaptation.race import MOST_DRAWS
from kendama_cli.adaptation.search_record import Attempt, MotionVariation, Search, Trial
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.adaptation.uncertainty import Repeat, drawn_errors, judging_errors
from kendama_cli.errors import SimulationError
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.rollout import RolloutResult
from kendama_cli.stages.adapt.logged import draw_message, log_replay
from kendama_cli.stages.adapt.messages import (
    AdaptEvaluationMessage,
    AdaptExploredMessage,
    AdaptRepeatMessage,
    AdaptRolloutMessage,
)
from kendama_cli.stages.adapt.rollouts import Rollouts
from kendama_cli.stages.interface import StageContext


class Trials:
    """Plays trials with ``rollouts``; of ``seeds`` the first is of what the search draws.

    Then come those of judging, and of the repeats last: how many of them there are changes nothing before them.
    """

    def __init__(
        self,
        rollouts: Rollouts,
        settings: AdaptSettings,
        game: GameSettings,
        seeds: Sequence[int],
        ctx: StageContext,
    ) -> None:
        self._rollouts, self._settings, self._game = rollouts, settings, game
        self._seeds, self._ctx = seeds, ctx

    @staticmethod
    def seeds_needed(settings: AdaptSettings) -> int:
        """How many seeds there must be."""
        return 1 + MOST_DRAWS + settings.repeats

    def play(self, search: Search, trial: Trial) -> Search:
        """``search`` with what came of ``trial``."""
        variation = trial.variation
        if trial.kind == "attempt":
            attempt = self._attempt(trial)
            lacks = self._rollouts.lacking_reach(variation, attempt.flight) if attempt.caught else None
            search = search.with_attempt(attempt)
            return search if lacks is None else search.without_reach(variation, lacks)
        if trial.kind == "explore":
            return search.with_attempt(self._explored(trial))
        if trial.kind == "prove" and trial.index == 0 and search.reaching([variation]):
            lacks = self._rollouts.lacking_reach(variation, search.flight(variation))
            if lacks is not None:
                return search.without_reach(variation, lacks)
        try:
            made = self._proof(trial, len(search.attempts)) if trial.kind == "prove" else self._repeat(trial)
        except SimulationError:  # one world is beyond the model: it is lost, the others are not
            made = Repeat(False, None)
        return search.with_repeat(trial, made)

    def _attempt(self, trial: Trial) -> Attempt:
        variation, rollouts = trial.variation, self._rollouts
        limit = rollouts.family.limit(variation)
        if limit is not None:
            return _forbidden(variation, limit)
        try:
            result = rollouts.planned(variation)
        except SimulationError as error:  # this motion is beyond the model: another may not be
            return _forbidden(variation, str(error))
        self._ctx.log.write("/adapt/rollout", float(trial.index), _rollout_message(trial, result))
        return attempt_made(variation, rollouts.family.swing(variation), result)

    def _explored(self, trial: Trial) -> Attempt:
        """A rollout of a policy search; all of a generation are in the same world."""
        variation, rollouts = trial.variation, self._rollouts
        generation = trial.index // self._settings.policy.generation
        limit = rollouts.family.limit(variation)
        if limit is not None:
            return _forbidden(variation, limit)
        try:
            result, (steered_m, _) = self._drawn(variation, [self._seeds[0], 0, generation])
        except SimulationError as error:
            return _forbidden(variation, str(error))
        made = attempt_made(variation, rollouts.family.swing(variation), result, steered_m)
        message = AdaptExploredMessage(
            index=trial.index,
            generation=generation,
            tau_scale=variation.tau_scale,
            cost_m=cost_m(made),
            miss_m=_or_nan(result.signed_miss_m),
            caught=result.caught,
            shift_x_m=variation.shift_m[0],
            shift_y_m=variation.shift_m[1],
            bumps_m=variation.bumps_m,
            swing_slack_s=result.swing_slack_s,
        )
        self._ctx.log.write("/adapt/explored", float(trial.index), message)
        return made

    def _proof(self, trial: Trial, rollouts: int) -> Repeat:
        """A repeat that judges a policy, in a world that nothing was played in."""
        result, _ = self._drawn(trial.variation, [self._seeds[0], 1, rollouts, trial.index])
        message = AdaptEvaluationMessage(rollouts, trial.index, result.caught, _or_nan(result.signed_miss_m))
        self._ctx.log.write("/adapt/evaluation", float(rollouts), message)
        return Repeat(result.caught, result.signed_miss_m, swing_slack_s=result.swing_slack_s)

    def _drawn(self, variation: MotionVariation, seed: list[int]) -> tuple[RolloutResult, tuple[float, float]]:
        rng = np.random.default_rng(seed)
        draw = drawn_errors(self._settings.uncertainty, self._game.rope.length_m, rng)
        return self._rollouts.judged(variation, draw, eyes_seed=int(rng.integers(2**62)), rng=rng)

    def _repeat(self, trial: Trial) -> Repeat:
        """Every candidate is judged in the same worlds; those that confirm are drawn afresh."""
        uncertainty, rope_m, log = self._settings.uncertainty, self._game.rope.length_m, self._ctx.log
        confirm = trial.kind == "confirm"
        seed = self._seeds[1 + trial.index + MOST_DRAWS * confirm]
        rng = np.random.default_rng(seed)
        draw = (
            drawn_errors(uncertainty, rope_m, rng)
            if confirm
            else judging_errors(uncertainty, rope_m, trial.index, self._seeds[0])
        )
        result, (shift_m, largest_m) = self._rollouts.judged(
            trial.variation, draw, eyes_seed=seed, rng=rng, record=confirm
        )
        if confirm:
            miss_m = _or_nan(result.signed_miss_m)
            message = AdaptRepeatMessage(trial.index, result.caught, miss_m, shift_m, largest_m)
            log.write("/adapt/repeat", float(trial.index), message)
            log_replay(self._ctx, trial.index, self._rollouts.world, draw.world, result)
            log.write("/adapt/perturbation", float(trial.index), draw_message(trial.index, draw, self._game))
        else:
            log.write("/adapt/candidate", float(trial.index), _rollout_message(trial, result))
        return Repeat(result.caught, result.signed_miss_m, shift_m, result.swing_slack_s)


def _forbidden(variation: MotionVariation, limit: str) -> Attempt:
    return Attempt(variation, False, None, None, 0.0, None, limit)


def attempt_made(
    variation: MotionVariation, swing: ArmMotion, result: RolloutResult, steered_m: float = 0.0
) -> Attempt:
    """The attempt at ``variation``, whose motion is ``swing``, with what came of it."""
    flight = None
    if result.flight_s is not None:
        start, end = ((t_s / variation.tau_scale - swing.lead_in_s) / swing.plan.duration_s for t_s in result.flight_s)
        flight = (start, end)
    return Attempt(
        variation,
        result.caught,
        result.signed_miss_m,
        result.side_miss_m,
        result.apex_m,
        flight,
        swing_slack_s=result.swing_slack_s,
        steered_m=steered_m,
    )


def _rollout_message(trial: Trial, result: RolloutResult) -> AdaptRolloutMessage:
    return AdaptRolloutMessage(
        index=trial.index,
        tau_scale=trial.variation.tau_scale,
        signed_miss_m=_or_nan(result.signed_miss_m),
        caught=result.caught,
        amplitude=trial.variation.amplitude,
        shift_x_m=trial.variation.shift_m[0],
        shift_y_m=trial.variation.shift_m[1],
        caught_later=result.caught_later,
    )


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else value
