"""Adapt: the primitive is fitted to the arm until the arm catches."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import Any

from kendama_cli.adaptation.catch_family import CatchFamily
from kendama_cli.adaptation.catch_search import TauSearch
from kendama_cli.adaptation.policy_search import PolicySearch
from kendama_cli.adaptation.search_record import Bounds, CatchSearch, MotionVariation, Search, Trial
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.adaptation.tilt import playable_tilt
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.artifacts.toy_model import ToyModel
from kendama_cli.errors import StageError
from kendama_cli.identification.friction_known import with_identified
from kendama_cli.motion.dmp.amplitude import scaled_plan
from kendama_cli.motion.dmp.heading import swing_heading_rad, turned_plan
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.find_placement import find_placement
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.placement import placed, turned
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.setup import SIGMAS_95
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.stages.adapt.conclusion import conclude
from kendama_cli.stages.adapt.rollouts import Rollouts, Standing
from kendama_cli.stages.adapt.trials import Trials
from kendama_cli.stages.interface import Made, StageContext, State


class Adapt:
    """Takes the MotionPlan of ``encode``; gives the CatchMotion of the arm in DART."""

    def __init__(self, *, adapt: AdaptSettings, robot: RobotSettings, game: GameSettings) -> None:
        self._settings, self._robot, self._game = adapt, robot, game

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> Made:
        """Search tau, then goal and size, in the closed loop; the result is judged by perturbed repeats.

        The search is made in the primitive's own plane: base and primitive are turned about the vertical until it
        swings along x, along which misses are signed, errors drawn and reaches asked for, and the result turned back.
        ``caught`` is the nominal outcome, ``success_rate`` that over fresh perturbed repeats, None without any. Where
        nothing catches the stage still ends, and its metrics say how near it came and what stands in the way. Raises
        StageError, naming the joint and its limit, where no tau in the range is within the arm's limits.
        """
        plan: MotionPlan = given["encode"]
        plan = scaled_plan(plan, self._settings.swing_scale, plan.tau_scale)
        toy: ToyModel | None = given.get("measure")
        if toy is not None:
            self._game, self._settings = toy.applied(self._game), _narrowed(self._settings, toy)
        settings = self._settings
        robot = self._placed(with_identified(self._robot, given.get("identify")), plan, ctx)
        heading_rad = swing_heading_rad(plan)
        world = ArmWorld(turned(robot, -heading_rad), self._game)
        plan, warnings = playable_tilt(world.arm, turned_plan(plan, -heading_rad), settings)
        family = CatchFamily(world.arm, plan, settings.lead_in_m_s2)
        rollouts = Rollouts(world, family, settings, self._game, standing=Standing(robot, heading_rad))
        bounds = family.bounds(settings.amplitudes, self._game.cup.radius_m)
        self._require_playable(family, bounds)
        saved = ctx.restore()
        search = Search() if saved is None else Search.from_json(saved["search"])
        if saved is None:
            seeds = ctx.rng("adapt repeats").integers(2**62, size=Trials.seeds_needed(settings)).tolist()
        else:
            seeds = [int(seed) for seed in saved["seeds"]]
        tau = settings.search == "tau"
        way: CatchSearch = TauSearch(settings, bounds) if tau else PolicySearch(settings, family, seeds[0])
        trials = Trials(rollouts, settings, self._game, seeds, ctx)
        while (trial := way.next_trial(search)) is not None:
            search = trials.play(search, trial)
            ctx.checkpoint(functools.partial(_state, search, seeds))
            done = way.rollouts(search)
            total = done + settings.repeats if trial.kind == "confirm" else None
            ctx.progress(done + len(search.confirmed), total, **_figures(trial, search))
        made = conclude(rollouts, search, way, settings=settings, bounds=bounds, eyes_seed=seeds[1], ctx=ctx)
        return dataclasses.replace(made, warnings=(*warnings, *made.warnings))

    def _placed(self, robot: RobotSettings, plan: MotionPlan, ctx: StageContext) -> RobotSettings:
        """The arm where it stands, or where the search finds that it should: the same after a resumption.

        The swing-up's line is kept in reach too, unless that leaves the motion beyond every tau that is allowed.
        """
        if self._settings.placement == "fixed":
            return robot

        def report_progress(done: int, total: int, cost: float) -> None:
            ctx.progress(done, total, placement=round(cost, 3))

        lead_in = self._settings.lead_in_m_s2
        find = functools.partial(find_placement, robot, self._game, plan, lead_in, effort=1.0, progress=report_progress)
        with contextlib.suppress(StageError):  # out of reach: perhaps only the line is
            found = placed(robot, find(line=self._settings.line))
            arm = RobotModel(found, self._game.cup, self._game.gravity_m_s2)
            if ArmMotion(arm, plan, lead_in).least_tau_scale() <= self._settings.tau_range[1]:
                return found
        return placed(robot, find(line=None))

    def _require_playable(self, family: CatchFamily, bounds: Bounds) -> None:
        """Raise StageError where no size that is searched can be played at all; a smaller one may be."""
        sizes = (1.0, *self._settings.amplitudes) if self._settings.search == "tau" else (1.0,)
        most = self._settings.tau_range[1]
        if any(bounds.lowest_tau.get(size, math.inf) <= most for size in sizes):
            return
        swing = family.swing(MotionVariation(1.0))  # out of reach: says so
        given = self._settings.placement == "fixed"
        otherwise = "place the arm otherwise (adapt.placement=search)" if given else "choose another robot"
        raise StageError(
            f"the motion would have to be {swing.least_tau_scale():.2f} times slower for {self._robot.name}, whose "
            f"{swing.limiting_joint()} stands in the way; "
            f"allowed: tau_scale up to {most}: raise adapt.tau_range, make it smaller (adapt.swing_scale), or "
            f"{otherwise}"
        )


def _state(search: Search, seeds: list[int]) -> State:
    return {"search": search.to_json(), "seeds": seeds}


def _figures(trial: Trial, search: Search) -> dict[str, float | int]:
    figures: dict[str, float | int] = {"tau": round(trial.variation.tau_scale, 4), "caught": search.caught()}
    if search.confirmed:
        figures["success_rate"] = round(sum(one.caught for one in search.confirmed) / len(search.confirmed), 2)
    return figures


def _narrowed(settings: AdaptSettings, toy: ToyModel) -> AdaptSettings:
    """The declared uncertainty with a rope that is no less certain than it was measured."""
    declared = settings.uncertainty
    known_m = min(declared.rope_m, SIGMAS_95 * toy.rope_sigma_m)
    return dataclasses.replace(settings, uncertainty=dataclasses.replace(declared, rope_m=known_m))
