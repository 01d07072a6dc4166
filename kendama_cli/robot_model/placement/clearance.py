"""The distance between the parts of an arm, what it stands on, and the ball's swing, along a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.motion.dmp.heading import heading_turn
from kendama_cli.motion.sampling import thinning
from kendama_cli.robot_model.chain import compiled_chain
from kendama_cli.robot_model.chain_kernel import Chain, CollisionGeometry, ToolGeometry, clearance
from kendama_cli.robot_model.model import HANDLE_RADIUS_M, RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

EVERY_S = 0.01
FAR_M = 1e3


@dataclass(frozen=True)
class Clearance:
    """The minimum gap between two parts; negative where they overlap."""

    gap_m: float
    parts: str
    t_s: float


def collision_geometry_about(
    arm: RobotModel, game: GameSettings, heading_rad: float, root_height_m: float, swing_rad: float = 0.0
) -> CollisionGeometry:
    """Return the parts that must not collide with the root at this pose: capsules of ``link_radius_m``, floor,
    pedestal,
    cup and swing.

    The pedestal reaches from the floor to the first joint and is as wide as the widest link. The ball swings in the
    vertical plane that is turned by ``swing_rad`` from x.
    """
    return CollisionGeometry(
        radius_m=np.array([max(arm.link_radius_m), *arm.link_radius_m, HANDLE_RADIUS_M]),
        floor_m=-root_height_m,
        side=heading_turn(swing_rad - heading_rad) @ np.array([0.0, 1.0, 0.0]),
        swing_m=game.rope.length_m + game.ball.radius_m,
        ball_m=game.ball.radius_m,
        cup_m=game.cup.reach_m,
    )


def tool_of(arm: RobotModel, chain: Chain, game: GameSettings) -> ToolGeometry:
    """Return the cup as ``arm`` holds it, with the ball in it."""
    axis = np.array(arm.settings.tool.cup_axis)
    return ToolGeometry(
        chain.tip_m + chain.tip_turn @ np.array(arm.settings.tool.handle_m),
        chain.tip_turn @ (axis / np.linalg.norm(axis)),
        game.cup.mass_kg + game.ball.mass_kg,
    )


def min_clearance(
    arm: RobotModel, game: GameSettings, joints: JointTrajectory, *, swing_rad: float | None = 0.0, floor_m: float = 0.0
) -> Clearance:
    """Return the minimum gap along ``joints``, the two parts that have it, and its time.

    The ball's swing in the vertical plane turned by ``swing_rad`` from x is such a part, but where that is None.
    The floor, or a table, is at the height ``floor_m`` in the world.
    """
    chain = compiled_chain(arm)
    settings = arm.settings
    root_m = settings.base_position_m[2] - floor_m
    geometry = collision_geometry_about(arm, game, settings.base_heading_rad, root_m, swing_rad or 0.0)
    if swing_rad is None:
        geometry = geometry._replace(swing_m=-FAR_M)
    thin = thinning(joints.t_s, EVERY_S)
    angles: Array = np.ascontiguousarray(joints.position_rad[::thin])
    gap, one, two, sample = clearance(chain, tool_of(arm, chain, game), geometry, angles, 1)
    names = _part(arm, one), _part(arm, two)
    return Clearance(float(gap), f"{names[0]} and {names[1]}", float(joints.t_s[::thin][sample]))


def _part(arm: RobotModel, number: int) -> str:
    n = len(arm.joint_names)
    others = {-1: "floor", 0: "pedestal", n + 1: "handle", n + 2: "cup", n + 3: "the ball's swing"}
    return others.get(number) or f"the link of '{arm.joint_names[number - 1]}'"
