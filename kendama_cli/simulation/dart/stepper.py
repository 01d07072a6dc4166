"""One step of DART after another: with a look for contacts, or without where nothing can touch."""

from __future__ import annotations

from typing import Any

import numpy as np

from kendama_cli.robot_model.arm_motion import SAMPLE_S
from kendama_cli.robot_model.dart_library import awake_world, dartpy
from kendama_cli.robot_model.joint_torque import JointTorque
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.ball import TetheredBall
from kendama_cli.simulation.dart.joint_control import JointControl
from kendama_cli.simulation.dart.rope_kernel import PIVOT, REACTION, SIDE
from kendama_cli.simulation.dart.scene import Scene
from kendama_cli.simulation.dart.wrist import ContactSensor

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


class Stepper:
    """Stepper of one of ``worlds`` under what ``control`` gives.

    Where only a ball is beside the arm, compiled code finds the joints' friction, and the world is the one without
    contacts while nothing can touch in the coming step and no joint comes to its limits. Beside a scene, on which the
    arm itself presses, and under commanded torques DART finds friction and contacts together, which takes longer.
    """

    def __init__(
        self,
        pair: WorldPair,
        control: JointControl,
        scene: Scene,
        ball: TetheredBall | None,
        sensor: ContactSensor | None,
    ) -> None:
        self._worlds, self._control, self._scene = pair, control, scene
        self._ball, self._sensor = ball, sensor
        self._alone = ball is not None and not scene.bodies
        self._apart, self._held = False, True  # a description may have given the joints a friction for DART to find

    def reset(self) -> None:
        """Reset scene and sensor; nothing that is past stays, and DART looks after the joints' limits."""
        self._worlds.renew()
        self._control.enforce_limits(enforce=True)
        self._apart = False
        self._control.rope = None
        if self._ball is not None:
            self._control.rope = np.zeros(3), np.zeros(3)
            self._control.take(self._ball)
        self._scene.reset()
        if self._sensor is not None:
            self._sensor.reset()

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
        if ball is None or not self._alone:
            control.follow(reference, noise_rad, added_nm, state, t_s)
            self._step_held(t_s)
            return
        if self._held:
            self._held = False
            control.friction.release()
        if not self._apart:
            ball.pressing.after(ball.velocity_m_s, ball.mass_kg, ball.weight_n)
        if control.follow_beside(ball, reference, noise_rad, added_nm, state, t_s) != self._apart:
            self._apart = not self._apart
            if self._apart:
                ball.pressing.let_go()
            control.enforce_limits(enforce=not self._apart)
        self.world.step()

    def give(self, command: JointTorque, state: tuple[Array, Array], t_s: float) -> None:
        """Step once under a commanded torque from ``state`` at ``t_s``; raises SimulationError."""
        self._control.give(command, state, t_s)
        self._step_held(t_s)

    @property
    def world(self) -> Any:
        """DART's world of the last step."""
        return self._worlds.apart if self._apart else self._worlds.touching

    def _step_held(self, t_s: float) -> None:
        """Step once with contacts, friction and stops left to DART."""
        self._held = True
        if self._apart:
            self._apart = False
            self._control.enforce_limits(enforce=True)
        if self._ball is not None:
            self._ball.pull(t_s)
            if self._ball.tension_n > 0.0:
                self._ball.react()
            self._control.rope = self._ball.pulled[REACTION:PIVOT], self._ball.pulled[PIVOT:SIDE]
        self._scene.pull()
        self._worlds.touching.step()
        if self._sensor is not None:
            self._sensor.read(self._worlds.touching)
