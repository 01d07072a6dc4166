"""Perturbed simulations, as they are sampled and shared."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.adaptation.perturbation import Perturbation
from kendama_cli.adaptation.search_record import (
    BLOCK,
    MAX_BLOCKS,
    MotionVariation,
    PerturbedSimulations,
    Repeat,
    Search,
    Trial,
)
from kendama_cli.adaptation.settings import UncertaintySettings
from kendama_cli.artifacts.proportion import Evaluation
from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import build
from kendama_cli.simulation.dart.arm_errors import ArmErrors, WorldErrors
from tests.shipped_conf import plain

MOTION = MotionVariation(1.0)


def _preset(name: str) -> UncertaintySettings:
    return build(UncertaintySettings, plain("adapt/uncertainty", name), "uncertainty")


def _seeded(uncertainty: UncertaintySettings, repeats: int = 0, seed: int = 10000) -> PerturbedSimulations:
    return PerturbedSimulations.seeded(uncertainty, 0.4, repeats, np.random.default_rng(seed))


def _arm(perturbation: Perturbation) -> ArmErrors:
    assert perturbation.arm is not None
    return perturbation.arm


def _facts(perturbation: Perturbation) -> tuple[object, ...]:
    assert perturbation.rng is not None
    return perturbation.world, perturbation.arm, perturbation.sensor_seed, perturbation.rng.bit_generator.state["state"]


def test_how_many_repeats_follow_changes_no_simulation_before_them() -> None:
    """With the seed of those drawn last, 30 and 200 repeats chose another tau."""
    few, many = _seeded(_preset("hard"), 2), _seeded(_preset("hard"), 30)
    trials = [Trial("evaluate", MOTION, index) for index in range(BLOCK * MAX_BLOCKS)]
    trials += [Trial("confirm", MOTION, 0), Trial("confirm", MOTION, 1), Trial("explore", MOTION, 5, 1)]
    facts = [[_facts(one.perturbation(trial)) for trial in trials] for one in (few, many)]
    assert facts[0] == facts[1]
    assert len({str(one) for one in facts[0]}) == len(trials)


@pytest.mark.parametrize(("lost", "thorough", "played"), [((), False, 10), ((4,), False, 30), ((), True, 30)])
def test_repeats_that_confirm_end_early_where_all_are_caught(
    lost: tuple[int, ...], thorough: bool, played: int
) -> None:
    search, evaluation = Search(_seeded(_preset("hard"), 30)), Evaluation(30, thorough=thorough)
    while (trial := search.next_confirmation(MOTION, evaluation)) is not None:
        assert trial == Trial("confirm", MOTION, len(search.simulations.confirmed))
        search = search.with_repeat(trial, Repeat(trial.index not in lost, None))
    assert len(search.simulations.confirmed) == played


def test_a_generation_shares_one_simulation_and_repeats_that_validate_have_fresh_ones() -> None:
    simulations = _seeded(_preset("hard"))

    def sampled(kind: str, index: int, group: int) -> str:
        return str(_facts(simulations.perturbation(Trial(kind, MOTION, index, group))))

    assert sampled("explore", 6, 1) == sampled("explore", 11, 1) != sampled("explore", 12, 2)
    others = {sampled("validate", index, rollouts) for index in range(3) for rollouts in (6, 12)}
    assert len(others | {sampled("explore", 6, 1)}) == 7


def test_the_simulations_that_evaluate_cover_every_quarter_of_every_range_and_are_the_same_again() -> None:
    shipped = _preset("hard")

    def sampled(seed: int) -> list[Perturbation]:
        simulations = _seeded(shipped, seed=seed)
        return [simulations.perturbation(Trial("evaluate", MOTION, index)) for index in range(12)]

    worlds = sampled(10000)
    assert [_facts(one) for one in worlds] == [_facts(one) for one in sampled(10000)]
    assert [one.world for one in worlds] != [one.world for one in sampled(10001)]
    for first in (0, 4, 8):
        block = worlds[first : first + 4]
        for values, (low, high) in (
            ([one.world.rope_scale for one in block], (0.995, 1.005)),
            ([one.world.restitution or 0.0 for one in block], shipped.restitution),
            ([_arm(one).lag_s for one in block], shipped.lag_s),
            ([_arm(one).cup_error_phase_rad for one in block], (0.0, 2 * np.pi)),
        ):
            assert sorted(int(4 * (value - low) / (high - low)) for value in values) == [0, 1, 2, 3]


def test_nothing_is_perturbed_where_nothing_may_differ() -> None:
    values = plain("adapt/uncertainty", "none") | {"restitution": [0.2, 0.2]}
    simulations = _seeded(build(UncertaintySettings, values, "uncertainty"), 1)
    one = simulations.perturbation(Trial("confirm", MOTION, 0))
    assert one.world == WorldErrors(restitution=0.2)
    assert (_arm(one).lag_s, _arm(one).cup_error_m) == (0.0, 0.0)
    assert simulations.undisturbed().world == WorldErrors()


@pytest.mark.parametrize("name", ["drag_scale", "restitution", "lag_s", "cup_error_hz", "rotor_scale"])
def test_a_range_the_wrong_way_round_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match=rf"'{name}' is \[0\.4, 0\.1\]; allowed: minimum, then maximum"):
        dataclasses.replace(_preset("hard"), **{name: (0.4, 0.1)})
