"""Trials of a search for a catch, run in simulations: undisturbed, or perturbed and with the visual catch."""

from __future__ import annotations

import numpy as np

from kendama_cli.adaptation.catch_family import CatchFamily, attempt_of
from kendama_cli.adaptation.perturbation import Perturbation
from kendama_cli.adaptation.search_record import Attempt, MotionVariation, Repeat, Search, Trial
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.control.catch_reach import lacking_reach
from kendama_cli.control.corrected_motion import CupPlan
from kendama_cli.control.visual_catch import VisualCatch, cup_plan
from kendama_cli.errors import SimulationError
from kendama_cli.simulation.dart.arm_errors import NO_ERRORS
from kendama_cli.simulation.dart.rollout import RolloutResult, play_rollout
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.stages.adapt.logged import log_attempt, log_repeat
from kendama_cli.stages.interface import StageContext

Shifts = tuple[float, float]
"""Distance of the cup from its plan [m]: at the catch, and the maximum."""


class Trials:
    """Trials with the motions of ``family`` in ``world``; a miss below ``mouth_m`` is a catch."""

    def __init__(
        self, world: ArmWorld, family: CatchFamily, settings: AdaptSettings, *, mouth_m: float, ctx: StageContext
    ) -> None:
        self.world, self.family = world, family
        self._settings, self._mouth_m, self._ctx = settings, mouth_m, ctx
        self._newest: tuple[MotionVariation, JointTrajectory, CupPlan] | None = None

    def run(self, search: Search, trial: Trial) -> Search:
        """Return ``search`` with the result of ``trial``."""
        if trial.kind in {"attempt", "explore"}:
            attempt = self._attempt(search, trial)
            search = search.with_attempt(attempt)
            catches = trial.kind == "attempt" and attempt.caught
            lacks = self._lacking_reach(trial.variation, attempt.flight) if catches else None
            return search if lacks is None else search.without_reach(trial.variation, lacks)
        if trial.kind == "validate" and trial.index == 0 and search.reaching([trial.variation]):
            lacks = self._lacking_reach(trial.variation, search.flight(trial.variation))
            if lacks is not None:
                return search.without_reach(trial.variation, lacks)
        return search.with_repeat(trial, self._repeat(trial, search.simulations.perturbation(trial)))

    def simulate(
        self, variation: MotionVariation, perturbation: Perturbation | None, *, record: bool = False
    ) -> tuple[RolloutResult, Shifts]:
        """Return the rollout of ``variation``: under ``perturbation`` with the catch that is set, else as planned.

        Raises SimulationError, and StageError if the arm cannot reach the motion.
        """
        settings, world = self._settings, self.world
        if perturbation is None:
            world.perturb(NO_ERRORS)
            return play_rollout(world, self._joints(variation)), (0.0, 0.0)
        joints, cup = self._motion(variation)
        visual = None
        if settings.catch == "visual":
            noise = np.random.default_rng([perturbation.sensor_seed, 1])
            visual = VisualCatch(
                world.arm,
                world.ball.game,
                joints,
                cup,
                sensor=settings.sensor_model,
                correction=settings.correction,
                rng=noise,
                errors=perturbation.sensor,
            )
        world.perturb(perturbation.world)
        result = play_rollout(
            world,
            joints,
            errors=perturbation.arm,
            noise_rad=perturbation.joint_noise_rad,
            rng=perturbation.rng,
            correction=visual,
            record=record,
        )
        return result, (0.0, 0.0) if visual is None else visual.shifts_m

    def as_modelled(self, variation: MotionVariation) -> Attempt:
        """Return the attempt at ``variation`` as planned, without errors or noise, which is not logged."""
        return self._played(variation, None)[0]

    def _attempt(self, search: Search, trial: Trial) -> Attempt:
        """Run an attempt, or a rollout of a policy search."""
        perturbation = search.simulations.perturbation(trial) if trial.kind == "explore" else None
        attempt, result = self._played(trial.variation, perturbation)
        if result is not None:
            log_attempt(self._ctx, trial, attempt, result)
        return attempt

    def _played(
        self, variation: MotionVariation, perturbation: Perturbation | None
    ) -> tuple[Attempt, RolloutResult | None]:
        """Simulate a motion; one that cannot be simulated is lost, others may not be."""
        limit = self.family.limit(variation)
        if limit is None:
            try:
                result, (shift_m, _) = self.simulate(variation, perturbation)
            except SimulationError as error:
                limit = str(error)
        if limit is not None:
            return Attempt(variation, False, None, None, 0.0, None, limit), None
        return attempt_of(variation, self.family.swing(variation), result, shift_m), result

    def _repeat(self, trial: Trial, perturbation: Perturbation) -> Repeat:
        try:
            result, shifts_m = self.simulate(trial.variation, perturbation, record=trial.kind == "confirm")
        except SimulationError:  # one simulation is beyond the model: it is lost, the others are not
            return Repeat(False, None)
        log_repeat(self._ctx, trial, result, shifts_m, world=self.world, perturbation=perturbation)
        return Repeat(result.caught, result.signed_miss_m, shifts_m[0], result.swing_slack_s)

    def _lacking_reach(self, variation: MotionVariation, flight: tuple[float, float] | None) -> str | None:
        """Return why a visual catch cannot go as far as the uncertainty asks for, or None.

        ``flight`` is the fraction of the motion in which the ball flies.
        """
        if self._settings.catch != "visual" or flight is None:
            return None
        swing = self.family.swing(variation)
        start_s, end_s = ((part * swing.plan.duration_s + swing.lead_in_s) * variation.tau_scale for part in flight)
        rim_m = self.world.ball.game.cup.rim_m
        _, cup = self._motion(variation)
        return lacking_reach(cup, (start_s, end_s), self._settings, rim_m=rim_m, mouth_m=self._mouth_m)

    def _motion(self, variation: MotionVariation) -> tuple[JointTrajectory, CupPlan]:
        """Return joints and cup of ``variation``, stored for its next rollout, which is mostly of the same."""
        if self._newest is None or self._newest[0] != variation:
            joints = self._joints(variation)
            self._newest = variation, joints, cup_plan(self.world.arm, joints)
        return self._newest[1:]

    def _joints(self, variation: MotionVariation) -> JointTrajectory:
        return self.family.swing(variation).joints(variation.tau_scale, self._settings.hold_s)
