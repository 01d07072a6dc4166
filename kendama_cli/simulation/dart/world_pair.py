"""DART's worlds of one arm: one in which bodies may touch, and one for the steps in which nothing can."""

from __future__ import annotations

from typing import Any

from kendama_cli.robot_model.arm_motion import SAMPLE_S
from kendama_cli.robot_model.dart_library import awake_world, dartpy

STEP_S = SAMPLE_S
"""Step of simulation and control, one sample of a planned motion.

At 1 ms nothing tunnels up to 8 m/s and the rope is far from its stability limit.
"""


class WorldPair:
    """Two worlds of DART that hold the same skeletons: ``touching`` looks for contacts, ``apart`` knows of no shapes.

    Both integrate alike; whoever steps ``apart`` knows that nothing can touch. Looking for contacts that are not there
    takes half of DART's step.
    """

    def __init__(self, gravity_m_s2: float, *, exact_friction: bool) -> None:
        self._gravity_m_s2, self._exact_friction = gravity_m_s2, exact_friction
        self.touching = self._new_world()
        self.apart = self._new_world()

    def add(self, skeleton: Any) -> None:
        """Let both worlds hold ``skeleton``, whose shapes are complete."""
        self.touching.addSkeleton(skeleton)
        self.apart.addSkeleton(skeleton)
        shapes = self.apart.getConstraintSolver().getCollisionGroup()
        shapes.setAutomaticUpdate(False)
        shapes.removeAllShapeFrames()

    def renew(self) -> None:
        """Forget all that is past: a solver would start from what it found before."""
        old = self.touching
        self.touching = self._new_world()
        skeletons = [old.getSkeleton(number) for number in range(old.getNumSkeletons())]
        old.removeAllSkeletons()
        for skeleton in skeletons:
            self.touching.addSkeleton(skeleton)

    def _new_world(self) -> Any:
        world = awake_world(STEP_S, self._gravity_m_s2)
        if self._exact_friction:
            # DART's default bounds friction by the normal force that would act without it: on an arm, whose directions
            # are coupled, that was wrong by a quarter; this one iterates until Coulomb's law holds
            world.getConstraintSolver().setBoxedLcpSolver(dartpy.constraint.NsgsFrictionSolver())
        return world
