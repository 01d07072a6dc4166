"""One step of DART after another: with a look for contacts, or without where nothing can touch."""

from __future__ import annotations

from typing import Any

from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.ball import TetheredBall
from kendama_cli.simulation.dart.joint_control import JointControl
from kendama_cli.simulation.dart.scene import Scene
from kendama_cli.simulation.dart.world_pair import WorldPair
from kendama_cli.simulation.dart.wrist import ContactSensor


class Stepper:
    """Steps one of ``worlds`` under what ``control`` gives: the one without contacts where only a ball is beside the
    arm, nothing can touch in the coming step and no joint comes to its limits.
    """

    def __init__(
        self,
        worlds: WorldPair,
        control: JointControl,
        scene: Scene,
        ball: TetheredBall | None,
        sensor: ContactSensor | None,
    ) -> None:
        self._worlds, self._control, self._scene = worlds, control, scene
        self._ball, self._sensor = ball, sensor
        self._alone = ball is not None and not scene.bodies
        self._apart = False

    def reset(self) -> None:
        """Scene and sensor as they began; nothing that is past stays, and DART looks after the joints' limits."""
        self._worlds.renew()
        self._control.enforce_limits(enforce=True)
        self._apart = False
        self._scene.reset()
        if self._sensor is not None:
            self._sensor.reset()

    def step(self, state: tuple[Array, Array], t_s: float) -> None:
        """One step from ``state``, angles and speeds (n,) of the joints, at ``t_s``; raises SimulationError."""
        ball, control = self._ball, self._control
        if ball is not None:
            ball.pull(t_s)
        if ball is not None and self._alone and control.move_apart(state, ball.state, ball.reaction, t_s):
            if not self._apart:
                self._apart = True
                control.enforce_limits(enforce=False)
            self._worlds.apart.step()
        else:
            if self._apart:
                self._apart = False
                control.enforce_limits(enforce=True)
            self._touch()

    @property
    def world(self) -> Any:
        """DART's world of the last step."""
        return self._worlds.apart if self._apart else self._worlds.touching

    def _touch(self) -> None:
        """The step in which DART looks for contacts, and after the joints' limits."""
        if self._ball is not None and self._ball.tension_n > 0.0:
            self._ball.react()
        self._control.move_touching()
        self._scene.pull()
        self._worlds.touching.step()
        if self._sensor is not None:
            self._sensor.read(self._worlds.touching)
