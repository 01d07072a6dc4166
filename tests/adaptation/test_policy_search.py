"""Trials that a policy search asks for, in a made-up world where a motion's miss is plain arithmetic."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any

import numpy as np
import pytest

from kendama_cli.adaptation.policy_search import FORBIDDEN_M, PolicySearch, cost_m
from kendama_cli.adaptation.search_record import Attempt, MotionVariation, PerturbedSimulations, Repeat, Search, Trial
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.errors import ConfigError
from kendama_cli.schema.artifacts import from_plain, to_plain
from kendama_cli.schema.settings import build
from kendama_cli.stages.adapt.conclusion import policy_obstacle
from tests.simulation.dart.bench_robot import adapt_values

SHIPPED = dataclasses.replace(build(AdaptSettings, adapt_values(), "adapt"), search="cma", repeats=3)
POLICY = SHIPPED.policy
SIMULATIONS = PerturbedSimulations(SHIPPED.uncertainty, 0.4, ())
BEGUN = Search(SIMULATIONS)


class AnyArm:
    """An arm that can do every motion, or none."""

    def __init__(self, forbidden: str | None = None) -> None:
        self.forbidden = forbidden

    def limit(self, variation: MotionVariation) -> str | None:
        return self.forbidden

    def within_limits(self, variation: MotionVariation, tau_range: tuple[float, float]) -> MotionVariation:
        return variation


def method(settings: AdaptSettings = SHIPPED, arm: AnyArm | None = None, seed: int = 10000) -> PolicySearch:
    return PolicySearch(settings, arm or AnyArm(), seed, settings.search)  # type: ignore[arg-type]


def missed_m(variation: MotionVariation) -> float:
    """A demonstration that misses by 0.3 m: what a larger swing and a moved goal mend."""
    return float(0.3 - 2.0 * np.dot(variation.bumps_m[:4], [1, -1, 1, -1]) - variation.shift_m[0])


def played(search: Search, trial: Trial, catches: bool = True) -> Search:
    off = missed_m(trial.variation)
    if trial.kind == "explore":
        return search.with_attempt(Attempt(trial.variation, abs(off) < 0.038, off, 0.0, 0.2, (0.7, 0.9)))
    world = np.random.default_rng([len(search.attempts), trial.index]).normal(0.0, 0.01)
    return search.with_repeat(trial, Repeat(catches and abs(off + world) < 0.038, off + world))


def searched(settings: AdaptSettings = SHIPPED, **how: Any) -> tuple[Search, list[Trial]]:
    search, trials = BEGUN, []
    catches = how.pop("catches", True)
    while (trial := method(settings, **how).next_trial(search)) is not None:
        trials.append(trial)
        if how.get("arm"):
            search = search.with_attempt(Attempt(trial.variation, False, None, None, 0.0, None, how["arm"].forbidden))
        else:
            search = played(search, trial, catches)
    return search, trials


@pytest.mark.parametrize("kind", ["cma", "power"])
def test_from_a_motion_that_misses_it_comes_to_one_that_lasts(kind: str) -> None:
    """Seeds 10000 to 10009 took 12 to 54 rollouts."""
    settings = dataclasses.replace(SHIPPED, search=kind)
    search, trials = searched(settings)
    chosen = method(settings).solved(search)
    assert chosen is not None
    assert abs(missed_m(chosen)) < 0.03
    assert method(settings).rollouts(search) <= 60
    assert [one.kind for one in trials[-3:]] == ["confirm"] * 3
    assert trials[-1].variation == chosen


def test_after_every_generation_repeats_judge_it_and_end_once_too_many_are_lost() -> None:
    search, trials = searched(
        dataclasses.replace(SHIPPED, policy=dataclasses.replace(POLICY, max_rollouts=18)), catches=False
    )
    kinds = [one.kind for one in trials]
    # three lost of thirty: no 28 are left
    assert kinds == (["explore"] * 6 + ["validate"] * 3) * 3
    assert [one.index for one in trials if one.kind == "explore"] == list(range(18))
    assert [one.index for one in trials if one.kind == "validate"] == [0, 1, 2] * 3
    assert method().best(search) is None
    assert re_says(policy_obstacle(search.attempts[0], search), "18 rollouts did not lead to a robust policy")


def re_says(line: str, words: str) -> bool:
    return words in line and "adapt.policy.max_rollouts" in line


def test_what_comes_next_is_the_same_from_the_record_that_was_saved() -> None:
    search, _ = searched()
    for made in (1, 7, len(search.attempts)):
        cut = Search(SIMULATIONS, search.attempts[:made])
        restored = from_plain(Search, json.loads(json.dumps(to_plain(Search, cut)[0])), {})
        assert restored == cut
        assert method().next_trial(restored) == method().next_trial(cut)


def test_motions_beyond_the_arm_are_no_rollouts_and_the_search_ends() -> None:
    settings = dataclasses.replace(SHIPPED, policy=dataclasses.replace(POLICY, max_rollouts=6))
    search, trials = searched(settings, arm=AnyArm("joint 'S3' with its speed limit of 1.00 rad/s"))
    assert method(settings).rollouts(search) == 0
    assert len(trials) == 18
    assert "every motion that was tried is forbidden by joint 'S3'" in policy_obstacle(search.attempts[0], search)


def test_a_policy_whose_rope_hangs_slack_in_the_swing_is_taken_only_where_there_is_no_other() -> None:
    slack, taut = MotionVariation(1.0, bumps_m=(0.01,) * 8), MotionVariation(1.0, bumps_m=(0.0,) * 8)
    enough, of = POLICY.stop_at

    def judged(*swings: tuple[MotionVariation, float, int]) -> Search:
        made = tuple((one, (Repeat(True, 0.0, 0.0, s),) * n + (Repeat(False, 0.1),) * (of - n)) for one, s, n in swings)
        return Search(dataclasses.replace(SIMULATIONS, evaluated=made))

    alone, beside = judged((slack, 0.08, of)), judged((slack, 0.08, of), (taut, 0.01, enough - 5))
    assert method().solved(alone) is method().solved(beside) is None
    assert method().best(alone) == slack
    assert method().best(beside) == taut
    assert method().solved(judged((taut, 0.01, enough))) == taut
    hung = Attempt(taut, True, 0.01, 0.0, 0.2, None, swing_slack_s=0.08)
    assert cost_m(hung) - cost_m(dataclasses.replace(hung, swing_slack_s=0.01)) == pytest.approx(0.06)


def test_a_policy_without_reach_is_passed_over_and_judged_only_where_there_is_no_other() -> None:
    settings = dataclasses.replace(SHIPPED, policy=dataclasses.replace(POLICY, max_rollouts=12))
    search, asked = BEGUN, []
    while (trial := method(settings).next_trial(search)) is not None:
        asked.append(trial)
        if trial.kind == "validate" and trial.variation not in dict(search.short_of_reach):
            search = search.without_reach(trial.variation, "it has 70 mm")
        else:
            search = played(search, trial, True)
    kinds = [one.kind for one in asked]
    assert kinds[:14] == (["explore"] * 6 + ["validate"]) * 2
    assert set(kinds[14:]) == {"validate"}
    assert method(settings).best(search) is None
    assert not search.simulations.confirmed
    assert 0 <= method(settings).expected(search, search.short_of_reach[-1][0]) <= 1


def test_a_rollout_costs_its_miss_its_height_or_the_way_that_a_seen_catch_went() -> None:
    here = MotionVariation(1.0)

    def cost(
        caught: bool, miss: float | None, apex: float = 0.2, steered: float = 0.0, limit: str | None = None
    ) -> float:
        return cost_m(Attempt(here, caught, miss, 0.0, apex, None, limit, correction_m=steered))

    assert cost(True, 0.01) == pytest.approx(0.01)
    assert cost(False, -0.2) == pytest.approx(0.2)
    assert cost(True, 0.002, steered=0.1) == pytest.approx(0.102)
    # bounced out of the middle: not better than the edge
    assert cost(False, 0.001) == pytest.approx(0.04)
    assert cost(False, None, apex=0.0) > cost(False, None, apex=0.1) > cost(False, -0.29)
    assert cost(False, None, apex=5.0) == cost(False, None, apex=0.3)
    assert cost(False, None, limit="a joint") == FORBIDDEN_M


def test_tau_bumps_and_goal_are_searched_about_their_start() -> None:
    settings = dataclasses.replace(SHIPPED, tau_start=1.1)
    taus = [method(settings, seed=seed).next_trial(BEGUN) for seed in range(10000, 10200)]
    logs = [math.log(one.variation.tau_scale / 1.1) for one in taus if one is not None]
    # 200 draws: mean within four standard errors of nothing, spread within four of the one that is set
    assert abs(np.mean(logs)) < 4 * POLICY.spread_tau / math.sqrt(200)
    assert np.std(logs) == pytest.approx(POLICY.spread_tau, rel=4 / math.sqrt(400))
    places = np.array([(*one.variation.bumps_m, *one.variation.shift_m) for one in taus if one is not None])
    assert places.shape == (200, 2 * POLICY.bumps + 2)
    assert np.std(places, axis=0) == pytest.approx(POLICY.spread_m, rel=4.5 / math.sqrt(400))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"stop_at": (31, 30)}, r"'stop_at' is \[31, 30\]; allowed: caught, then of how many"),
        ({"goal_moves": (0.9, 0.5)}, r"'goal_moves' is \[0\.9, 0\.5\]; allowed: start, then end"),
        ({"max_rollouts": 4}, r"'max_rollouts' is 4; allowed: at least one generation, 6"),
    ],
)
def test_settings_that_make_no_sense_are_refused(change: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        dataclasses.replace(POLICY, **change)


@pytest.mark.parametrize(
    ("node", "key", "value", "says"),
    [
        ("policy", "bumps", 0, r"adapt\.policy\.bumps"),
        ("policy", "spread_m", -0.1, r"adapt\.policy\.spread_m"),
        ("policy", "generation", 2, r"adapt\.policy\.generation"),
        (None, "search", "gradient", r"adapt\.search.*tau.*cma.*power.*random"),
        (None, "size", 0.0, r"adapt\.size"),
    ],
)
def test_values_out_of_range_are_refused_by_their_key(node: str | None, key: str, value: object, says: str) -> None:
    values = adapt_values()
    (values if node is None else values[node])[key] = value
    with pytest.raises(ConfigError, match=says):
        build(AdaptSettings, values, "adapt")
