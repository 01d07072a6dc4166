"""Stage adapt: the primitive is fitted to the arm until the arm catches."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
from collections.abc import Mapping
from typing import Any

from kendama_cli.adaptation.aim_search import AimedMotions, AimSearch
from kendama_cli.adaptation.catch_family import CatchFamily, playable_tilt
from kendama_cli.adaptation.catch_search import TauSearch
from kendama_cli.adaptation.policy_search import PolicySearch
from kendama_cli.adaptation.search_record import (
    MOUTH_SHARE,
    Bounds,
    CatchSearch,
    MotionVariation,
    PerturbedSimulations,
    Search,
    Trial,
)
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.kendama_model import KendamaModel
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.heading import scaled_plan, swing_heading_rad, turned_plan
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.friction import with_identified
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.find_placement import find_placement
from kendama_cli.schema.artifacts import from_plain, to_plain
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.placement import placed, turned
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.setup import SIGMAS_95
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.stages.adapt.conclusion import conclude
from kendama_cli.stages.adapt.trials import Trials
from kendama_cli.stages.interface import StageContext, StageResult, State


class Adapt:
    """Stage from the MotionPlan of ``encode`` to the CatchMotion of the arm in DART."""

    def __init__(self, *, adapt: AdaptSettings, robot: RobotSettings, game: GameSettings) -> None:
        self._settings, self._robot, self._game = adapt, robot, game

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Search tau, then goal and size, in the closed loop; evaluate the result by perturbed repeats.

        The search is made in the primitive's own plane: base and primitive are turned about the vertical until it
        swings along x, along which misses are signed, errors sampled and reaches asked for, and the result turned back.
        ``caught`` is the nominal outcome, ``success_rate`` that over fresh perturbed repeats, None without any. If
        nothing catches the stage still ends, and its metrics say how near it came and the reason. Raises StageError,
        naming the joint and its limit, if no tau in the range is within the arm's limits.
        """
        settings, game, plan = self._settings, self._game, given["encode"]
        plan = scaled_plan(plan, settings.swing_scale, plan.tau_scale)
        measured: KendamaModel | None = given.get("measure")
        if measured is not None:
            game, settings = measured.applied(game), _narrowed(settings, measured)
        robot = _placed(with_identified(self._robot, given.get("identify")), game, plan, settings, ctx)
        heading_rad = swing_heading_rad(plan)
        world = ArmWorld(turned(robot, -heading_rad), game)
        plan, warnings = playable_tilt(world.arm, turned_plan(plan, -heading_rad), settings)
        family = CatchFamily(world.arm, plan, settings.lead_in_m_s2)
        bounds = Bounds(family.lowest_tau, MOUTH_SHARE * game.cup.radius_m)
        _require_playable(family, settings, robot)
        search = _begun(settings, game, ctx)
        trials = Trials(world, family, settings, mouth_m=bounds.mouth_m, ctx=ctx)
        method = _method(settings, family, bounds, trials, search.simulations.seeds[0])
        while (trial := method.next_trial(search)) is not None:
            search = trials.run(search, trial)
            ctx.checkpoint(functools.partial(_state, search))
            _report(ctx, trial, search, method.rollouts(search), settings.repeats)
        arm = RobotModel(robot, game.cup, game.gravity_m_s2)
        made = conclude(
            trials, search, method, settings=settings, bounds=bounds, arm=arm, heading_rad=heading_rad, ctx=ctx
        )
        return dataclasses.replace(made, warnings=(*warnings, *made.warnings))


def _method(settings: AdaptSettings, family: CatchFamily, bounds: Bounds, trials: Trials, seed: int) -> CatchSearch:
    """Return the method of the search that the settings choose."""
    match settings.search:
        case "tau":
            return TauSearch(settings, bounds)
        case "aim":
            motions = AimedMotions(settings, family, trials.as_modelled, settings.tau_start)
            return AimSearch(settings, motions, seed, mouth_m=bounds.mouth_m)
        case name:
            return PolicySearch(settings, family, seed, name)


def _narrowed(settings: AdaptSettings, measured: KendamaModel) -> AdaptSettings:
    """Return ``settings`` with a rope that is no less certain than it was ``measured``."""
    declared = settings.uncertainty
    known_m = min(declared.rope_m, SIGMAS_95 * measured.rope_sigma_m)
    return dataclasses.replace(settings, uncertainty=dataclasses.replace(declared, rope_m=known_m))


def _placed(
    robot: RobotSettings, game: GameSettings, plan: MotionPlan, settings: AdaptSettings, ctx: StageContext
) -> RobotSettings:
    """Return the arm at its own base, or at that which a search finds: the same after a resumption.

    The swing-up's line is kept in reach too, unless that leaves the motion beyond every tau that is allowed.
    """
    if settings.placement == "fixed":
        return robot

    def report_progress(done: int, total: int, cost: float) -> None:
        ctx.progress(done, total, placement=round(cost, 3))

    lead_in = settings.lead_in_m_s2
    find = functools.partial(find_placement, robot, game, plan, lead_in, effort=1.0, progress=report_progress)
    with contextlib.suppress(StageError):  # out of reach: perhaps only the line is
        found = placed(robot, find(line=settings.line))
        arm = RobotModel(found, game.cup, game.gravity_m_s2)
        if ArmMotion(arm, plan, lead_in).min_tau_scale() <= settings.tau_range[1]:
            return found
    return placed(robot, find(line=None))


def _require_playable(family: CatchFamily, settings: AdaptSettings, robot: RobotSettings) -> None:
    """Raise StageError if no size that is searched can be played at all; a smaller one may be."""
    sizes = (1.0, *settings.amplitudes) if settings.search == "tau" else (1.0,)
    maximum = settings.tau_range[1]
    if any(family.lowest_tau(size) <= maximum for size in sizes):
        return
    swing = family.swing(MotionVariation(1.0))  # out of reach: says so
    given = settings.placement == "fixed"
    otherwise = "place the arm otherwise (adapt.placement=search)" if given else "choose another robot"
    raise StageError(
        f"the motion would have to be {swing.min_tau_scale():.2f} times slower for {robot.called}, whose "
        f"{swing.limiting_joint()} forbids it; "
        f"allowed: tau_scale up to {maximum}: raise adapt.tau_range, make it smaller (adapt.swing_scale), or "
        f"{otherwise}"
    )


def _begun(settings: AdaptSettings, game: GameSettings, ctx: StageContext) -> Search:
    """Return the search that a checkpoint holds, or a new one."""
    saved = ctx.restore()
    if saved is not None:
        search: Search = from_plain(Search, saved["search"], {})
        return search
    rng = ctx.rng("adapt repeats")
    held = settings.simulations == "held"
    return Search(
        PerturbedSimulations.seeded(settings.uncertainty, game.rope.length_m, settings.repeats, rng, held=held)
    )


def _state(search: Search) -> State:
    return {"search": to_plain(Search, search)[0]}


def _report(ctx: StageContext, trial: Trial, search: Search, rollouts: int, repeats: int) -> None:
    confirmed = search.simulations.confirmed
    figures: dict[str, float | int] = {"tau": round(trial.variation.tau_scale, 4), "caught": search.caught()}
    if confirmed:
        figures["success_rate"] = round(sum(one.caught for one in confirmed) / len(confirmed), 2)
    total = rollouts + repeats if trial.kind == "confirm" else None
    ctx.progress(rollouts + len(confirmed), total, **figures)
