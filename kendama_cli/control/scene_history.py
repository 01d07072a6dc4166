"""Scene of a simulated robot, for virtual cameras and for nobody else."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot, SceneState, WrappedRobot
from kendama_cli.motion.rotation import between as turned_between
from kendama_cli.motion.rotation import matrix_of, quaternion_of
from kendama_cli.rendering.scene import ScenePose, hanging_rope
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array

KEPT_PERIODS = 64
"""Control periods that are remembered: a frame and its delay reach back 20 ms or so."""
HANDLE_END_M = 0.04
"""So far below the tie point is the end of the rods that stand for arm and handle."""
SHARED_M = 1e-3


class SceneHistory:
    """Scene of the last control periods, straight between them; it is the ``Scene`` of virtual cameras.

    Positions are relative to ``origin_m`` (3,), in whose frame the cameras are. ``arm_places`` gives the points
    (k, 3) that an arm is drawn through for its joint angles (n,); the rope is tied to ``tie_m`` of the cup's own frame.
    """

    def __init__(
        self,
        arm_places: Callable[[Array], Array],
        rope_m: float,
        origin_m: Array,
        tie_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        self.rope_m, self._tie_m = rope_m, np.array(tie_m)
        self._arm_places, self.origin_m = arm_places, np.asarray(origin_m)
        self._times: list[float] = []
        self._scenes: list[SceneState] = []
        self._rollout: list[tuple[float, ...]] = []

    def clear(self) -> None:
        """Begin a new rollout."""
        self._times.clear()
        self._scenes.clear()
        self._rollout.clear()

    def add(self, t_s: float, scene: SceneState) -> None:
        """Add the scene at the end of a control period."""
        self._times.append(t_s)
        self._scenes.append(scene)
        del self._times[:-KEPT_PERIODS], self._scenes[:-KEPT_PERIODS]
        self._rollout.append((t_s, *scene.cup_m.tolist(), *scene.cup_rotation[:, 2].tolist(), *scene.ball_m.tolist()))

    def rollout(self) -> Array:
        """Return the whole rollout (n, 10): time from its start, cup, the cup's axis and ball in the world."""
        path = np.array(self._rollout)
        path[:, 0] -= path[0, 0]
        return path

    @property
    def reported(self) -> bool:
        """True if the robot reports its scene at all."""
        return bool(self._times)

    def position_rad(self, t_s: float) -> Array:
        """Return the true joint angles (n,) at ``t_s``."""
        last, coming, part = self._about(t_s)
        return np.asarray(last.position_rad + part * (coming.position_rad - last.position_rad))

    def _about(self, t_s: float) -> tuple[SceneState, SceneState, float]:
        """Return the scenes before and after ``t_s``, and the part of their time that has passed then."""
        times, scenes = self._times, self._scenes
        after = int(np.searchsorted(times, t_s))
        last, coming = scenes[max(after - 1, 0)], scenes[min(after, len(scenes) - 1)]
        span = times[min(after, len(times) - 1)] - times[max(after - 1, 0)]
        return last, coming, (t_s - times[after - 1]) / span if span > 0 else 0.0

    def __call__(self, t_s: float) -> ScenePose:
        """Return all poses at ``t_s``, held before the first and after the last period that is known."""
        last, coming, part = self._about(t_s)

        def between(name: str) -> Array:
            one, two = getattr(last, name), getattr(coming, name)
            return np.asarray(one + part * (two - one))

        cup, ball = between("cup_m") - self.origin_m, between("ball_m") - self.origin_m
        ends = np.array([quaternion_of(one.cup_rotation) for one in (last, coming)])
        rotation = matrix_of(turned_between(np.array([0.0, 1.0]), ends, np.array([part]))[0])
        arm = self._arm_places(self.position_rad(t_s)) - self.origin_m
        return ScenePose(
            ball_m=ball,
            cup_m=cup,
            cup_rotation=rotation,
            rope_m=hanging_rope(cup + rotation @ self._tie_m, ball, self.rope_m),
            arm_m=np.vstack([arm, cup - HANDLE_END_M * rotation[:, 2]]),
        )


def joint_places(arm: RobotModel, position_rad: Array) -> Array:
    """Return the joints' origins (k, 3) in the world from base to tip; the last is the tip link's.

    Where neighbours share one, as the axes of a wrist do, it is returned once: their distance never changes.
    """
    chain = arm.joint_positions_m(position_rad)
    apart = np.linalg.norm(np.diff(chain, axis=0), axis=1) > SHARED_M
    return np.asarray(chain[np.concatenate([apart, [True]])])


def cup_rotation_wxyz(arm: RobotModel, position_rad: Array) -> Array:
    """Return the cup's rotation in the world (4,) for the joint angles (n,)."""
    return quaternion_of(arm.tool_pose(position_rad).rotation)


class SceneRecordingRobot(WrappedRobot):
    """Robot whose scene goes into ``history`` and is removed from every exchange that others see."""

    def __init__(self, robot: Robot, history: SceneHistory) -> None:
        super().__init__(robot)
        self._history = history

    def exchange(self, command: JointCommand) -> Exchange:
        """Exchange one control period; raises HardwareError as the robot does."""
        return self._recorded(self._robot.exchange(command))

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Reset the robot."""
        self._history.clear()
        return self._recorded(self._robot.reset(position_rad, seed))

    def _recorded(self, exchange: Exchange) -> Exchange:
        if exchange.scene is None:
            return exchange
        self._history.add(exchange.t_s, exchange.scene)
        return dataclasses.replace(exchange, scene=None)
