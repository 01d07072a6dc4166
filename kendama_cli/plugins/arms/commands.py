"""The commands about an arm before it plays."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli.options import Arm, ConfigDir, Home, Json, Overrides, PipelineName
from kendama_cli.config.site import find_site


def robot_describe(
    overrides: Overrides = None, as_json: Json = False, home: Home = None, config_dir: ConfigDir = None
) -> int:
    """Show what is read of a robot's description: joints, tip, limits and their sources, what is assumed or missing.

    Example: kendama robot describe robot=iiwa
    """
    from kendama_cli.plugins.arms.describe import describe  # dartpy

    return describe(find_site(home, config_dir), overrides or [], as_json=as_json)


def robot_check(
    overrides: Overrides = None,
    pipeline: PipelineName = "imitation",
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> int:
    """Check the imitated swing against limits, stops, gaps, table and workspace, with margins; nothing moves.

    Example: kendama robot check robot=iiwa
    """
    from kendama_cli.plugins.arms.check import check  # dartpy and compiled code

    return check(find_site(home, config_dir), pipeline, overrides or [], as_json=as_json)


def robot_recover(
    overrides: Overrides = None,
    arm: Arm = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Take a robot out of its latched stop, and say where it stands; it does not move before the next run.

    Example: kendama robot recover hardware=udp --arm
    """
    from kendama_cli.plugins.arms.check import recover  # dartpy

    recover(find_site(home, config_dir), overrides or [], armed=arm)


def robot_place(
    overrides: Overrides = None,
    pipeline: PipelineName = "imitation",
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="Write a node, e.g. conf/robot/mine.yaml for robot=mine."),
    ] = None,
    line: Annotated[
        bool, typer.Option("--line", help="Keep the swing-up's line within reach too, for the whole game.")
    ] = False,
    effort: Annotated[float, typer.Option(min=0.01, max=100.0, help="Scales the time spent on the search.")] = 1.0,
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Find where the arm should stand, and how hold the cup, for the configured demonstrations (about a minute).

    Example: kendama robot place robot=urdf robot.path=arm.urdf -o arm.yaml
    """
    from kendama_cli.plugins.arms.place import PlaceOptions, place  # dartpy and compiled code

    options = PlaceOptions(output, line, effort, as_json)
    place(find_site(home, config_dir), pipeline, overrides or [], options)
