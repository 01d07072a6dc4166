"""Family of motions among which a search chooses: one primitive at any tau, size, goal, shape, and playable tilt."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from kendama_cli.adaptation.search_record import Attempt, MotionVariation
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.motion import minimum_jerk
from kendama_cli.motion.dmp.heading import scaled_plan
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.motion.dmp.turning import rotations_of, tilt_only, with_turn_fraction
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.rollout import RolloutResult

SAMPLES = 500
RIDGE = 1e-9
"""Relative weight of the parameters' size in the fit: it only keeps basis functions that move nothing at rest."""
PHASE: Array = np.linspace(0.0, 1.0, SAMPLES)
"""Fractions of the motion at which a displacement is given, from its start at 0 to its end at 1."""

BUMPED = ("x", "z")
"""Coordinates with bumps, the swing's plane; a ball that comes down beside it is met by the goal."""

ENDS = 0.15
"""Within this fraction of the motion at either end a bump is taken to nothing, so that start and goal stay."""


def bumps(count: int) -> Array:
    """Return ``count`` bumps (count, SAMPLES), of height 1 but near the ends: Gaussians as wide as they are apart.

        b_i(s) = exp(-(s - c_i)^2 / (2 w^2)) e(s),   c_i = i w,  w = 1 / (count + 1)

    with e rising from 0 and falling back to it within ENDS, by the step of minimum jerk.
    """
    width = 1.0 / (count + 1)
    centers = width * np.arange(1, count + 1)[:, None]
    ends = minimum_jerk.step(PHASE / ENDS) * minimum_jerk.step((1.0 - PHASE) / ENDS)
    return np.asarray(np.exp(-0.5 * ((PHASE - centers) / width) ** 2) * ends)


def bumped_plan(plan: MotionPlan, heights_m: tuple[float, ...]) -> MotionPlan:
    """Return the primitive with its path displaced by bumps of these heights, first along x, then as many along z.

    Coordinates that the motion lacks are not displaced.
    """
    height = np.reshape(heights_m, (len(BUMPED), -1))
    change = weight_changes(plan, height @ bumps(height.shape[1]), np.zeros(len(BUMPED)))
    weights = np.array(plan.weights)
    for row, name in zip(change, BUMPED, strict=True):
        if name in plan.coordinates:
            weights[plan.coordinates.index(name)] += row
    return dataclasses.replace(plan, weights=weights)


def shifted_plan(plan: MotionPlan, shift_m: tuple[float, float], flight: tuple[float, float]) -> MotionPlan:
    """Return the primitive with its goal moved by ``shift_m`` along x and y, the path there made during ``flight``.

    ``flight`` is the fraction of the motion, from 0 to 1, in which the rope is slack. The path is a step of minimum
    jerk

        d s^3 (10 - 15 s + 6 s^2),   s from 0 to 1 over the flight.

    Coordinates that the motion lacks are not shifted.
    """
    desired = minimum_jerk.step((PHASE - flight[0]) / max(flight[1] - flight[0], 1e-3))
    change = weight_changes(plan, desired[None], np.ones(1))[0]
    step: Array = np.array([dict(zip("xy", shift_m, strict=True)).get(name, 0.0) for name in plan.coordinates])
    return dataclasses.replace(plan, goal_m=plan.goal_m + step, weights=plan.weights + step[:, None] * change[None, :])


def weight_changes(plan: MotionPlan, desired_m: Array, goal_m: Array) -> Array:
    """Return weights (k, m) that displace a coordinate by ``desired_m`` (k, SAMPLES) and its goal by ``goal_m`` (k,).

    A primitive's position is linear in goal and weights (equations.md eq. 3), so that least squares find them.
    """
    m = len(plan.centers)
    t_s = PHASE * plan.duration_s
    still = dataclasses.replace(
        plan,
        coordinates=tuple(f"w{j}" for j in range(m)),
        tau_scale=1.0,
        start_m=np.zeros(m),
        start_velocity_m_s=np.zeros(m),
        goal_m=np.zeros(m),
        goal_velocity_m_s=np.zeros(m),
        variation=np.zeros((0, 1 + m * (3 + m))),
        weights=np.eye(m),
        turn=None,
    )
    response = play(still, t_s).position_m
    goal_response = play(dataclasses.replace(still, weights=np.zeros((m, m)), goal_m=np.ones(m)), t_s).position_m[:, 0]
    scale = np.linalg.norm(response, axis=0)
    unit = response / scale
    residual = desired_m.T - np.outer(goal_response, goal_m)
    found: Array = np.linalg.solve(unit.T @ unit + RIDGE * np.eye(m), unit.T @ residual) / scale[:, None]
    return found.T


class CatchFamily:
    """All variations of ``plan`` for ``arm``; each path of the cup is solved once and stretched in time."""

    def __init__(self, arm: RobotModel, plan: MotionPlan, lead_in_m_s2: float) -> None:
        self._arm = arm
        self._plan = plan
        self._lead_in_m_s2 = lead_in_m_s2
        self._solved: dict[MotionVariation, ArmMotion] = {}

    def plan(self, variation: MotionVariation) -> MotionPlan:
        """Return the primitive so varied."""
        plan = scaled_plan(self._plan, variation.amplitude, variation.tau_scale)
        if variation.bumps_m:
            plan = bumped_plan(plan, variation.bumps_m)
        return shifted_plan(plan, variation.shift_m, variation.flight) if variation.shifted else plan

    def swing(self, variation: MotionVariation) -> ArmMotion:
        """Return the arm's motion, to be read at ``variation.tau_scale``.

        Raises StageError if the arm cannot reach it.
        """
        path = dataclasses.replace(variation, tau_scale=1.0)
        if path not in self._solved:
            self._solved[path] = ArmMotion(self._arm, self.plan(path), self._lead_in_m_s2)
        return self._solved[path]

    def limit(self, variation: MotionVariation) -> str | None:
        """Return the joint's limit that forbids this motion, in words; None if nothing does."""
        try:
            swing = self.swing(variation)
        except StageError as error:
            return str(error)
        return None if swing.min_tau_scale() <= variation.tau_scale else swing.limiting_joint()

    def within_limits(self, variation: MotionVariation, tau_range: tuple[float, float]) -> MotionVariation:
        """Return ``variation`` as much slower as the arm's limits ask for, if ``tau_range`` allows it."""
        try:
            minimum = max(tau_range[0], self.swing(variation).min_tau_scale())
        except StageError:  # nothing is slow enough for a place that is out of reach: ``limit`` tells it
            return variation
        return dataclasses.replace(variation, tau_scale=min(max(variation.tau_scale, minimum), tau_range[1]))

    def lowest_tau(self, amplitude: float) -> float:
        """Return the least tau within the arm's limits at ``amplitude``; infinite if its path is out of reach."""
        try:
            return self.swing(MotionVariation(1.0, amplitude)).min_tau_scale()
        except StageError:  # too large for the arm: the other sizes remain
            return math.inf


def attempt_of(
    variation: MotionVariation, swing: ArmMotion, result: RolloutResult, correction_m: float = 0.0
) -> Attempt:
    """Return the attempt at ``variation``, whose motion is ``swing``, with the ``result`` of its rollout."""
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
        correction_m=correction_m,
        forward=math.copysign(1.0, result.forward_m or 1.0),
    )


LESS = (1.0, 0.75, 0.5, 0.25)
TOLD_SPIN_RAD = np.radians(5)


def playable_tilt(arm: RobotModel, plan: MotionPlan, settings: AdaptSettings) -> tuple[MotionPlan, tuple[str, ...]]:
    """Return ``plan`` with as much rotation as the arm can play within ``settings.tau_range``, and what is left out.

    The turn about the cup's own axis is always left out: the cup is round, and the arm needs the freedom.
    """
    if plan.turn is None:
        return plan, ()
    tilt, spin = tilt_only(rotations_of(plan, np.linspace(0.0, plan.duration_s * plan.tau_scale, 200)))
    notes = []
    if spin.max() > TOLD_SPIN_RAD and settings.tilt_fraction > 0:
        notes.append(
            f"left out: the cup's rotation about its own axis, up to {np.degrees(spin.max()):.0f} deg; the cup is round"
        )
    fractions = [settings.tilt_fraction * less for less in LESS] if settings.tilt_fraction > 0 else []
    reason = ""
    for fraction in fractions:
        attempted = with_turn_fraction(plan, fraction)
        try:
            swing = ArmMotion(arm, attempted, settings.lead_in_m_s2)
        except StageError as error:
            reason = str(error)
            continue
        if swing.min_tau_scale() > settings.tau_range[1]:
            reason = swing.limiting_joint()
            continue
        if fraction < 1:
            notes.append(_less(fraction, float(tilt.max()), reason or "adapt.tilt_fraction"))
        return attempted, tuple(notes)
    notes.append(_less(0.0, float(tilt.max()), reason or "adapt.tilt_fraction=0"))
    return with_turn_fraction(plan, 0.0), tuple(notes)


def _less(share: float, most_rad: float, reason: str) -> str:
    return f"the cup's tilt of up to {np.degrees(most_rad):.0f} deg is played to {share:.0%} only: {reason}"
