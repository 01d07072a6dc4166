"""The search that is left where no aim leads to a catch, in a made-up world beside its model."""

from __future__ import annotations

import copy
import dataclasses
import json
import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from kendama_cli.adaptation.aim import MAX_POOR, Aim, AimedRollout, predicted
from kendama_cli.adaptation.aim_search import IN_A_ROW, AimedMotions, AimSearch
from kendama_cli.adaptation.search_record import Attempt, MotionVariation, PerturbedSimulations, Search
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.learning.parameter_search import CmaSearch
from kendama_cli.schema.settings import build
from kendama_cli.stages.transfer.aiming import ImitationAims
from kendama_cli.stages.transfer.progress import AttemptFigures
from tests.simulation.dart.bench_robot import adapt_values

SETTINGS = build(AdaptSettings, adapt_values(), "adapt")
POLICY = dataclasses.replace(SETTINGS.policy, max_rollouts=60)
MOUTH_M, SEED = 0.03, 7
FAMILY = SimpleNamespace(limit=lambda variation: None, within_limits=lambda variation, tau_range: variation)


def modelled(variation: MotionVariation) -> Attempt:
    """The model: tau and the first bump along x move the miss, the goal moves it back."""
    tau = math.log(variation.tau_scale) / POLICY.spread_tau
    x = -0.1 + 0.1 * tau + 0.1 * variation.bumps_m[0] / POLICY.spread_m - 0.9 * variation.shift_m[0]
    return Attempt(variation, abs(x) < MOUTH_M, x, -0.8 * variation.shift_m[1], 0.2, (0.7, 0.9))


def world(variation: MotionVariation) -> Attempt:
    """Other than in the model the ball rises only by the first bump along z, of which the miss says nothing there."""
    said = modelled(variation)
    apex_m = 0.1 * variation.bumps_m[POLICY.bumps] / POLICY.spread_m - 0.05
    if apex_m < 0.0:
        return dataclasses.replace(said, caught=False, signed_miss_m=None, side_miss_m=None, apex_m=apex_m)
    return dataclasses.replace(said, apex_m=apex_m)


@pytest.fixture(scope="module")
def motions() -> AimedMotions:
    settings = dataclasses.replace(SETTINGS, policy=POLICY)
    return AimedMotions(settings, cast("Any", FAMILY), modelled, 1.0)


@pytest.fixture(scope="module")
def searched(motions: AimedMotions) -> tuple[Attempt, ...]:
    settings = dataclasses.replace(SETTINGS, policy=POLICY)
    method = AimSearch(settings, motions, SEED, mouth_m=MOUTH_M)
    seeded = PerturbedSimulations.seeded(SETTINGS.uncertainty, 0.4, 0, np.random.default_rng(1))
    search = Search(seeded)
    while (trial := method.next_trial(search)) is not None and trial.kind == "explore":
        search = search.with_attempt(world(trial.variation))
    return search.attempts


def test_cma_es_catches_where_no_aim_does(searched: tuple[Attempt, ...]) -> None:
    aimed = searched[: MAX_POOR + 1]
    assert not any(one.caught for one in aimed)
    assert all(world(one.variation).signed_miss_m is None for one in aimed), "none of them would catch when repeated"
    assert len(searched) < POLICY.max_rollouts
    assert [one.caught for one in searched[-IN_A_ROW:]] == [True] * IN_A_ROW
    assert len({one.variation for one in searched}) == len(searched) - IN_A_ROW + 1, "the catch alone comes again"


def test_motions_have_the_models_gains_and_shifts_that_the_arm_can_do(motions: AimedMotions) -> None:
    """A shift is halved until it is allowed, five times at most, and else left out; all heights are in the plan's."""
    assert motions.path.gain == pytest.approx((-0.9, -0.8))
    assert motions.path.first_m == pytest.approx(-0.1)
    narrow = copy.copy(motions)
    forbids = lambda one: None if abs(one.shift_m[0]) < 0.05 else "a joint"  # noqa: E731
    narrow._family = cast("Any", SimpleNamespace(**vars(FAMILY) | {"limit": forbids}))
    for asked, allowed in ((0.04, 0.04), (0.3, 0.0375), (0.7, 0.04375), (0.9, 0.0)):
        aim, variation = narrow.playable(Aim(0.06, (asked, asked / 2), (0.0,) * (len(motions.path.parameters[0]))))
        assert (aim.along_m, aim.shift_m) == (0.06, (allowed, allowed / 2))
        assert variation.shift_m == aim.shift_m
        assert variation.flight == ((0.7, 0.9) if allowed else (0.0, 1.0))
        assert modelled(dataclasses.replace(variation, shift_m=(0.0, 0.0))).signed_miss_m == pytest.approx(
            0.06, abs=1e-3
        )
    bent, before = (motions.playable(Aim(0.06, bent=one))[1] for one in ((0.5, *np.eye(8)[3]), ()))
    assert math.log(bent.tau_scale / before.tau_scale) == pytest.approx(0.5 * POLICY.spread_tau)
    assert np.subtract(bent.bumps_m, before.bumps_m) == pytest.approx(POLICY.spread_m * np.eye(8)[3])


@pytest.mark.parametrize("played", [0, 7])
def test_where_aims_fail_cma_es_searches_about_the_best_of_them(motions: AimedMotions, played: int) -> None:
    """Proposals are in spreads of bumps and goal; after seven costs the second of its second generation."""
    aimed = [AimedRollout(Aim(0.1 * k, (0.02, 0.01 * k)), False, (0.3 - 0.1 * k * (2 - k), 0.05)) for k in range(3)]
    costs = [1.0 + 0.1 * k for k in range(played)]
    generation, dimension = POLICY.generation, len(motions.path.parameters[0])
    cma = CmaSearch(dimension + 2, generation, SEED).after([costs[:generation]] if played else [])
    *bent, x, y = cma.proposals[played % generation]
    found = motions.searched(aimed, costs, SEED)
    assert generation == 6
    assert found.along_m == 0.1
    assert found.shift_m == pytest.approx((0.02 + POLICY.spread_m * x, 0.01 + POLICY.spread_m * y))
    assert found.bent == pytest.approx(bent)


def about(motions: AimedMotions) -> ImitationAims:
    """Return the aims of transfer among ``motions``, without the arm that they are simulated on."""
    aims = ImitationAims.__new__(ImitationAims)
    vars(aims).update(_heading_rad=0.0, _motions=motions, _mouth_m=MOUTH_M, _seed=SEED)
    return aims


@pytest.mark.parametrize("unled_m", [(-0.12, 0.05), None])
def test_a_play_that_was_not_led_counts_by_what_the_model_does_not_tell_of_it(
    motions: AimedMotions,
    monkeypatch: pytest.MonkeyPatch,
    unled_m: tuple[float, float] | None,
) -> None:
    """The model says -0.10 m of the motion as planned, and -0.12 m of what the servo made of it; -0.15 m was missed."""
    aims = about(motions)
    monkeypatch.setattr(ImitationAims, "_unled_m", lambda self, servo: unled_m)
    unled = AttemptFigures(None, (0.0, 0.0), False, (-0.15, 0.05), 0.2, led=False)
    aim = aims.next([unled], 1.0, cast("Any", "servo"))
    if unled_m != (-0.12, 0.05):
        assert aim == aims.first, "nothing counts where the model's ball does not come down"
    else:
        x, _ = predicted(motions.path, aim)
        assert x == pytest.approx(0.15 - 0.12), "the residual is -0.03 m along x"
        assert aim.shift_m[1] == pytest.approx(0.0)


def test_transfer_plays_the_same_motions_and_none_twice(motions: AimedMotions, searched: tuple[Attempt, ...]) -> None:
    aims = about(motions)
    played: list[AttemptFigures] = []
    rope_scale = 1.1
    for expected in searched[: 1 - IN_A_ROW]:
        aim, variation = motions.playable(aims.next(played, rope_scale))
        assert variation == expected.variation
        attempt = world(variation)
        missed_m = None
        if attempt.signed_miss_m is not None:
            missed_m = (rope_scale * attempt.signed_miss_m, rope_scale * (attempt.side_miss_m or 0.0))
        figures = AttemptFigures(
            aim.along_m,
            aim.shift_m,
            attempt.caught,
            missed_m,
            rope_scale * attempt.apex_m,
            led=True,
            bent=aim.bent,
        )
        played.append(AttemptFigures.of(json.loads(json.dumps(dataclasses.asdict(figures)))))
    assert played[-1].caught
    assert motions.playable(aims.aim(played[-1]))[1] == searched[-1].variation
