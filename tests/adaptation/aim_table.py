"""Table of the aim in fixed simulations of `hard`, open loop on the PA10: rollouts to a catch.

    python -m tests.adaptation.aim_table [ROW ...] [FIRST_SEED [LAST_SEED]]

A seed is one arm and kendama, the same in all its rollouts: only the ball's start and the noise change, and in rows
with `phase` the phase of the cup's error. Rows: `failing` and `phase` (the bundled swing 4 at 0.85 of its size, aimed),
`cma` (the same by CMA-ES), `bundled` (the mean of the bundled swings, aimed), `again` (that motion again and again, the
baseline), `alike` and `cma-alike` (both from the motion of the first row that the model says catches). By words alone,
from the first row's motion: `words-2` (short, long), `words-6` (each with a grade), both with `-wrong` (each word drawn
anew in one of ten), and `words-random` (six words, all drawn anew, the baseline); `words-lab` (twelve words, left and
right among them) and `lab` (aimed) in simulations of `lab`. `beyond` (aimed, then CMA-ES) and `beyond-again` (aimed,
then the best of these motions again and again, the baseline) are on an arm that lags by BEYOND_LAG_S, unled.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import sys
from collections.abc import Callable, Iterator, Sequence
from unittest import mock

import numpy as np

from kendama_cli.adaptation.aim import Aim, AimedRollout
from kendama_cli.adaptation.aim_search import IN_A_ROW, AimedMotions, AimSearch, missed
from kendama_cli.adaptation.aim_words import CAUGHT, SIDES, Outcome, next_aim_by_words
from kendama_cli.adaptation.catch_family import CatchFamily, playable_tilt
from kendama_cli.adaptation.policy_search import cost_m
from kendama_cli.adaptation.search_record import (
    MOUTH_SHARE,
    MotionVariation,
    PerturbedSimulations,
    Search,
    Trial,
)
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.learning.parameter_search import parameter_search
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.motion.dmp.heading import scaled_plan
from kendama_cli.report.intervals import mean_interval
from kendama_cli.schema.settings import build
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.stages.adapt.trials import Trials
from tests.adaptation.spoken import ALONG, spoken
from tests.memory_context import MemoryContext
from tests.motion.swings import settings as encode_settings
from tests.shipped_conf import plain
from tests.simulation.dart.bench_robot import ROOT, adapt_values, bench_arm, kendama_game

FIRST_SEED, LAST_SEED = 30000, 30059
MAX_ROLLOUTS = 20
BEYOND_LAG_S, BEYOND_ROLLOUTS = 0.12, 60
SWING_4, ALL = "swing-04.csv", "swing-*.csv"
BUNDLED_TAU = 1.143
"""The time scale that `adapt` finds for the mean of the bundled swings."""


class Condition:
    """Motion of the bundled demonstrations ``files`` at ``size`` and ``tau``, and the aims about it."""

    def __init__(
        self,
        files: str,
        *,
        size: float,
        tau: float,
        phase_change: float = 0.0,
        uncertainty: str = "hard",
        lag_s: float | None = None,
    ) -> None:
        self.max_rollouts = MAX_ROLLOUTS if lag_s is None else BEYOND_ROLLOUTS
        made = build(AdaptSettings, adapt_values() | {"uncertainty": plain("adapt/uncertainty", uncertainty)}, "adapt")
        self.settings = settings = dataclasses.replace(
            made,
            uncertainty=dataclasses.replace(
                made.uncertainty,
                cup_error_phase_change=max(phase_change, made.uncertainty.cup_error_phase_change),
                lag_s=made.uncertainty.lag_s if lag_s is None else (lag_s, lag_s),
            ),
            policy=dataclasses.replace(made.policy, max_rollouts=self.max_rollouts),
            catch="open_loop",
            tau_start=tau,
            repeats=0,
        )
        self.game, world = kendama_game(), ArmWorld(bench_arm(), kendama_game())
        rows = [
            np.loadtxt(file, delimiter=",", skiprows=3) for file in sorted((ROOT / "data/demonstrations").glob(files))
        ]
        swings = [Demonstration(str(k), one[:, 0], one[:, 1:4] - one[0, 1:4]) for k, one in enumerate(rows)]
        plan = scaled_plan(encode_demonstrations(swings, encode_settings()), size, 1.0)
        self.family = CatchFamily(world.arm, playable_tilt(world.arm, plan, settings)[0], settings.lead_in_m_s2)
        self.mouth_m = MOUTH_SHARE * self.game.cup.radius_m
        self.trials = Trials(world, self.family, settings, mouth_m=self.mouth_m, ctx=MemoryContext(0))
        self.motions = AimedMotions(settings, self.family, self.trials.as_modelled, tau)

    def search(self, seed: int) -> Search:
        """Return a search in the simulation of ``seed``, as the stage `adapt` begins it."""
        rng = MemoryContext(seed).rng("adapt repeats")
        uncertainty, rope_m = self.settings.uncertainty, self.game.rope.length_m
        return Search(PerturbedSimulations.seeded(uncertainty, rope_m, 0, rng, held=True))

    def aimed(self, seed: int) -> list[bool]:
        """Return the catches of the aim until IN_A_ROW in a row."""
        search = self.search(seed)
        method = AimSearch(self.settings, self.motions, search.simulations.seeds[0], mouth_m=self.mouth_m)
        while (trial := method.next_trial(search)) is not None and len(search.attempts) < self.max_rollouts:
            search = self.trials.run(search, trial)
        return [one.caught for one in search.attempts]

    def best_again(self, seed: int) -> list[bool]:
        """Return the catches of the aim, and where it has failed those of its best motion, played again and again."""

        def best(_: AimedMotions, aimed: Sequence[AimedRollout], costs_m: Sequence[float], seed: int) -> Aim:
            return min(aimed, key=lambda one: float(np.hypot(*one.miss_m))).aim

        with mock.patch.object(AimedMotions, "searched", best):
            return self.aimed(seed)

    def by_words(self, seed: int, *, graded: bool, wrong: float = 0.0, sides: Sequence[str] = ALONG) -> list[bool]:
        """Return the catches of the aim by words, until the first one."""
        search, path, rng = self.search(seed), self.motions.path, np.random.default_rng([seed, 1])
        told: list[tuple[Aim, Outcome]] = []
        while len(told) < MAX_ROLLOUTS and not (told and told[-1][1].caught):
            aim, variation = self.motions.playable(next_aim_by_words(path, told))
            search = self.trials.run(search, Trial("explore", variation, len(told), len(told)))
            attempt = search.attempts[-1]
            miss_m = missed(attempt, path.forward)
            answer = spoken(miss_m, path.forward, graded=graded, wrong=wrong, sides=sides, rng=rng)
            told.append((aim, Outcome(CAUGHT) if attempt.caught else answer))
        return [one.caught for one in search.attempts]

    def by_shape(self, seed: int) -> list[bool]:
        """Return the catches of CMA-ES from the first motion, until the first catch; fresh noise in each rollout."""
        search, policy = self.search(seed), self.settings.policy
        first = self.motions.path.parameters_at(self.motions.path.first_m)
        cma = parameter_search(
            "cma",
            len(first) + 2,
            search.simulations.seeds[0],
            generation=policy.generation,
            elite=policy.elite,
            reward_cost=policy.reward_m,
        )
        costs: list[list[float]] = []
        while True:
            generation = []
            for proposal in cma.after(costs).proposals:
                variation = self._proposed(first, proposal)
                trial = Trial("explore", variation, len(search.attempts), len(search.attempts))
                search = self.trials.run(search, trial)
                if search.attempts[-1].caught or len(search.attempts) == MAX_ROLLOUTS:
                    return [one.caught for one in search.attempts]
                generation.append(cost_m(search.attempts[-1]))
            costs.append(generation)

    def again(self, seed: int) -> list[bool]:
        """Return the catches of the first motion, played twice."""
        search, first = self.search(seed), MotionVariation(self.settings.tau_start)
        for index in range(2):
            search = self.trials.run(search, Trial("explore", first, index, index))
        return [one.caught for one in search.attempts]

    def _proposed(self, first: np.ndarray, proposal: np.ndarray) -> MotionVariation:
        policy, settings = self.settings.policy, self.settings
        tau, *heights = (first + proposal[:-2]).tolist()
        x, y = (policy.spread_m * proposal[-2:]).tolist()
        variation = MotionVariation(
            settings.tau_start * float(np.exp(policy.spread_tau * tau)),
            shift_m=(x, y),
            flight=policy.goal_moves,
            bumps_m=tuple(policy.spread_m * one for one in heights),
        )
        return self.family.within_limits(variation, settings.tau_range)


@functools.cache
def failing() -> Condition:
    """Return the motion that no time scale catches."""
    return Condition(SWING_4, size=0.85, tau=1.0)


@functools.cache
def bundled() -> Condition:
    """Return the motion of all bundled demonstrations."""
    return Condition(ALL, size=1.0, tau=BUNDLED_TAU)


@functools.cache
def laboratory() -> Condition:
    """Return the motion that no time scale catches, in simulations of `lab`."""
    return Condition(SWING_4, size=0.85, tau=1.0, uncertainty="lab")


@functools.cache
def beyond() -> Condition:
    """Return the motion that no time scale catches, on an arm whose lag the model does not know."""
    return Condition(SWING_4, size=0.85, tau=1.0, lag_s=BEYOND_LAG_S)


def caught_in_the_model() -> Condition:
    """Return the first condition with the motion that the model says catches as its first."""
    made, motions = copy.copy(failing()), copy.copy(failing().motions)
    motions.path = dataclasses.replace(motions.path, first_m=motions.path.clipped(0.0))
    made.motions = motions
    return made


ROWS: dict[str, Callable[[], Callable[[int], list[bool]]]] = {
    "failing": lambda: failing().aimed,
    "alike": lambda: caught_in_the_model().aimed,
    "cma-alike": lambda: caught_in_the_model().by_shape,
    "bundled": lambda: bundled().aimed,
    "again": lambda: bundled().again,
    "phase": lambda: Condition(SWING_4, size=0.85, tau=1.0, phase_change=1.0).aimed,
    "cma": lambda: failing().by_shape,
    "words-2": lambda: functools.partial(failing().by_words, graded=False),
    "words-6": lambda: functools.partial(failing().by_words, graded=True),
    "words-2-wrong": lambda: functools.partial(failing().by_words, graded=False, wrong=0.1),
    "words-6-wrong": lambda: functools.partial(failing().by_words, graded=True, wrong=0.1),
    "words-random": lambda: functools.partial(failing().by_words, graded=True, wrong=1.0),
    "words-lab": lambda: functools.partial(laboratory().by_words, graded=True, sides=tuple(SIDES)),
    "lab": lambda: laboratory().aimed,
    "beyond": lambda: beyond().aimed,
    "beyond-again": lambda: beyond().best_again,
}


def first_catch(caught: Sequence[bool], maximum: int) -> int:
    """Return the number of the first catch, ``maximum`` without one."""
    return caught.index(True) + 1 if True in caught else maximum


def in_a_row(caught: Sequence[bool], maximum: int) -> int:
    """Return the number of rollouts to IN_A_ROW catches in a row, ``maximum`` without them."""
    ends = [k + 1 for k in range(IN_A_ROW - 1, len(caught)) if all(caught[k + 1 - IN_A_ROW : k + 1])]
    return ends[0] if ends else maximum


def _mean(values: Sequence[float]) -> str:
    low, high = mean_interval(np.array(values, dtype=np.float64)) or (float("nan"),) * 2
    return f"{np.mean(values):.2f} [{low:.2f}, {high:.2f}]"


def _fraction(flags: Sequence[bool]) -> str:
    interval = success_interval(sum(flags), len(flags))
    return f"{sum(flags)} of {len(flags)} [{interval.low:.2f}, {interval.high:.2f}]"


def told(name: str, series: Sequence[list[bool]]) -> Iterator[str]:
    """Yield what the rollouts of all seeds say."""
    maximum = BEYOND_ROLLOUTS if name.startswith("beyond") else MAX_ROLLOUTS
    firsts = [first_catch(one, maximum) for one in series]
    yield f"{name}: first catch {_mean(firsts)}"
    for within in (1, 2, 3):
        yield f"{name}: by rollout {within} {_fraction([any(one[:within]) for one in series])}"
    yield f"{name}: none within {maximum} {_fraction([not any(one) for one in series])}"
    yield f"{name}: three in a row {_mean([in_a_row(one, maximum) for one in series])}"


def main() -> None:
    """Print the rows that are asked for, seed by seed and in sum."""
    names = [one for one in sys.argv[1:] if not one.isdigit()] or list(ROWS)
    first, last = ([int(one) for one in sys.argv[1:] if one.isdigit()] + [FIRST_SEED, LAST_SEED])[:2]
    firsts: dict[str, list[int]] = {}
    for name in names:
        play, series = ROWS[name](), []
        for seed in range(first, last + 1):
            series.append(play(seed))
            print(name, seed, "".join(".X"[one] for one in series[-1]), flush=True)
        print("\n".join(told(name, series)), flush=True)
        firsts[name] = [first_catch(one, MAX_ROLLOUTS) for one in series]
    if {"alike", "cma-alike"} <= set(firsts):
        difference = np.subtract(firsts["cma-alike"], firsts["alike"])
        print("cma-alike minus alike: first catch", _mean(difference.tolist()))


if __name__ == "__main__":
    main()
