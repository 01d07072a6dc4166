"""One step of DART after another: with a look for contacts, or without where nothing can touch."""

from __future__ import annotations

from typing import Any

from kendama_cli.robot_model.arm_motion import SAMPLE_S
from kendama_cli.robot_model.dart_library import awake_world
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.ball import TetheredBall
from kendama_cli.simulation.dart.joint_control import JointControl

STEP_S = SAMPLE_S
"""Step of simulation and control, one sample of a planned motion.

At 1 ms nothing tunnels up to 8 m/s and the rope is far from its stability limit.
"""


class WorldPair:
    """Two worlds of DART that hold the same skeletons: ``touching`` looks for contacts, ``apart`` knows of no shapes.

    Both integrate alike; whoever steps ``apart`` knows that nothing can touch. Looking for contacts that are not there
    takes half of DART's step.
    """

    def __init__(self, gravity_m_s2: float) -> None:
        self._gravity_m_s2 = gravity_m_s2
        self.touching, self.apart = (awake_world(STEP_S, gravity_m_s2) for _ in range(2))

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
        self.touching = awake_world(STEP_S, self._gravity_m_s2)
        skeletons = [old.getSkeleton(number) for number in range(old.getNumSkeletons())]
        old.removeAllSkeletons()
        for skeleton in skeletons:
            self.touching.addSkeleton(skeleton)


class Stepper:
    """Stepper of one of ``worlds`` under what ``control`` gives to the arm and its ``ball``.

    Compiled code finds the joints' friction, and the world is the one without contacts while nothing can touch in the
    coming step and no joint comes to its limits.
    """

    def __init__(self, pair: WorldPair, control: JointControl, ball: TetheredBall) -> None:
        self._worlds, self._control, self._ball = pair, control, ball
        self._apart = False

    def reset(self) -> None:
        """Begin anew: nothing that is past stays, and DART looks after the joints' limits."""
        self._worlds.renew()
        self._control.enforce_limits(enforce=True)
        self._apart = False
        self._control.take(self._ball)

    def follow(
        self,
        reference: tuple[Array, Array, Array],
        noise_rad: Array | float,
        added_nm: Array | float,
        state: tuple[Array, Array],
        t_s: float,
    ) -> None:
        """Step once from ``state``, angles and velocities (n,) of the joints, at ``t_s``; raises SimulationError."""
        ball, control = self._ball, self._control
        if not self._apart:
            ball.pressing.after(ball.velocity_m_s, ball.mass_kg, ball.weight_n)
        if control.follow(ball, reference, noise_rad, added_nm, state, t_s) != self._apart:
            self._apart = not self._apart
            if self._apart:
                ball.pressing.let_go()
            control.enforce_limits(enforce=not self._apart)
        self.world.step()

    @property
    def world(self) -> Any:
        """DART's world of the last step."""
        return self._worlds.apart if self._apart else self._worlds.touching
