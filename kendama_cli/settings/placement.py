"""Base of an arm and pose of its cup: the result of a search over placements, and the reach that it keeps."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from kendama_cli.schema.settings import setting
from kendama_cli.settings.robot import RobotSettings, ToolSettings


@dataclass(frozen=True)
class LineSettings:
    """The line along x of the swing-up and the catch, which a searched placement keeps in reach."""

    half_width_m: float = setting("Maximum distance of the cup from the line's centre [m].", above=0)
    max_speed_m_s: float = setting("Maximum speed of the cup on the line [m/s].", above=0)
    acceleration_m_s2: float = setting("Maximum acceleration of the cup on the line [m/s^2].", above=0)


@dataclass(frozen=True)
class Placement:
    """Base, posture, tool and redundancy of one arm; the units are those of the fields of RobotSettings."""

    base_position_m: tuple[float, float, float]
    base_heading_rad: float
    home_rad: tuple[float, ...]
    handle_m: tuple[float, float, float]
    cup_axis: tuple[float, float, float]
    redundancy_weights: tuple[float, ...]


def turned(robot: RobotSettings, angle_rad: float) -> RobotSettings:
    """Return the same arm standing turned by ``angle_rad`` about the world's z, base and heading."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    x, y, z = robot.base_position_m
    return dataclasses.replace(
        robot, base_position_m=(c * x - s * y, s * x + c * y, z), base_heading_rad=robot.base_heading_rad + angle_rad
    )


def placed(robot: RobotSettings, placement: Placement) -> RobotSettings:
    """Return the same arm at ``placement``."""
    return dataclasses.replace(
        robot,
        tool=ToolSettings(handle_m=placement.handle_m, cup_axis=placement.cup_axis),
        base_position_m=placement.base_position_m,
        base_heading_rad=placement.base_heading_rad,
        home_rad=placement.home_rad,
        redundancy_weights=placement.redundancy_weights,
    )
