"""The motions among which the search chooses: one primitive at any tau, size, place of the catch and shape."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np

from kendama_cli.adaptation.path_bumps import bumped_plan
from kendama_cli.adaptation.path_response import SHARE, weights_of
from kendama_cli.adaptation.search_record import Bounds, MotionVariation
from kendama_cli.adaptation.uncertainty import MOUTH_SHARE
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.motion import minimum_jerk
from kendama_cli.motion.dmp.amplitude import scaled_plan
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array


class CatchFamily:
    """All variations of ``plan`` for ``arm``; each path of the cup is solved once and stretched in time."""

    def __init__(self, arm: RobotModel, plan: MotionPlan, lead_in_m_s2: float) -> None:
        self._arm = arm
        self._plan = plan
        self._lead_in_m_s2 = lead_in_m_s2
        self._solved: dict[MotionVariation, ArmMotion] = {}

    def plan(self, variation: MotionVariation) -> MotionPlan:
        """The primitive so varied."""
        plan = scaled_plan(self._plan, variation.amplitude, variation.tau_scale)
        if variation.bumps_m:
            plan = bumped_plan(plan, variation.bumps_m)
        return shifted_plan(plan, variation.shift_m, variation.flight) if variation.shifted else plan

    def swing(self, variation: MotionVariation) -> ArmMotion:
        """The arm's motion, to be read at ``variation.tau_scale``; raises StageError where the arm cannot reach."""
        one = dataclasses.replace(variation, tau_scale=1.0)
        if one not in self._solved:
            self._solved[one] = ArmMotion(self._arm, self.plan(one), self._lead_in_m_s2)
        return self._solved[one]

    def limit(self, variation: MotionVariation) -> str | None:
        """Which joint's limit forbids this motion, in words, or None where nothing does."""
        try:
            swing = self.swing(variation)
        except StageError as error:
            return str(error)
        return None if swing.least_tau_scale() <= variation.tau_scale else swing.limiting_joint()

    def within_limits(self, variation: MotionVariation, tau_range: tuple[float, float]) -> MotionVariation:
        """``variation`` as much slower as the arm's limits ask for, if ``tau_range`` allows it."""
        try:
            least = max(tau_range[0], self.swing(variation).least_tau_scale())
        except StageError:  # nothing is slow enough for a place that is out of reach: ``limit`` tells it
            return variation
        return dataclasses.replace(variation, tau_scale=min(max(variation.tau_scale, least), tau_range[1]))

    def bounds(self, amplitudes: tuple[float, ...], cup_radius_m: float) -> Bounds:
        """Where to search; amplitudes whose path the arm cannot reach are left out, that of the motion itself too.

        A path is solved when it is first asked for: mostly that of the motion itself suffices.
        """
        return Bounds(_LowestTau(self, (1.0, *amplitudes)), MOUTH_SHARE * cup_radius_m)


class _LowestTau(Mapping[float, float]):
    """The least tau within the arm's limits by amplitude, each found when it is asked for."""

    def __init__(self, family: CatchFamily, amplitudes: tuple[float, ...]) -> None:
        self._family, self._amplitudes = family, amplitudes
        self._found: dict[float, float] = {}

    def __getitem__(self, amplitude: float) -> float:
        if amplitude not in self._found:
            if amplitude not in self._amplitudes:
                raise KeyError(amplitude)
            try:
                self._found[amplitude] = self._family.swing(MotionVariation(1.0, amplitude)).least_tau_scale()
            except StageError:  # too large for the arm: the other sizes remain
                raise KeyError(amplitude) from None
        return self._found[amplitude]

    def __iter__(self) -> Iterator[float]:
        return (one for one in dict.fromkeys(self._amplitudes) if self.get(one) is not None)

    def __len__(self) -> int:
        return sum(1 for _ in self)


def shifted_plan(plan: MotionPlan, shift_m: tuple[float, float], flight: tuple[float, float]) -> MotionPlan:
    """The primitive with its goal moved by ``shift_m`` along x and y, and the way there made during ``flight``.

    ``flight`` is the share of the motion, from 0 to 1, in which the rope is slack. The way is a step of minimum jerk

        d s^3 (10 - 15 s + 6 s^2),   s from 0 to 1 over the flight.

    Coordinates that the motion has not are not shifted.
    """
    wanted = minimum_jerk.step((SHARE - flight[0]) / max(flight[1] - flight[0], 1e-3))
    change = weights_of(plan, wanted[None], np.ones(1))[0]
    step: Array = np.array([dict(zip("xy", shift_m, strict=True)).get(name, 0.0) for name in plan.coordinates])
    return dataclasses.replace(plan, goal_m=plan.goal_m + step, weights=plan.weights + step[:, None] * change[None, :])
