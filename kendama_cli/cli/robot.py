"""The commands about robots: keys, the twin, where an arm should stand, the check before it moves, recovery."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli import render
from kendama_cli.cli.groups import open_group
from kendama_cli.cli.options import Arm, ConfigDir, Home, Json, Overrides, PipelineName
from kendama_cli.config.site import find_site
from kendama_cli.errors import UsageError

robot_app = typer.Typer(
    cls=open_group("robot"), help="Robots: description, keys, twin, place, check, recovery.", no_args_is_help=True
)

KEY_FILE = "~/.config/kendama/robot.key"


@robot_app.command("key")
def robot_key(file: Annotated[str, typer.Argument(metavar="[FILE]", help="File to write it to.")] = KEY_FILE) -> None:
    """Make the key that a robot and its commander share; give the robot's controller a copy of the file.

    Example: kendama robot key robot.key
    """
    from kendama_cli.devices.robot.udp.seal import make_key  # dartpy

    render.text(str(make_key(file)))


@robot_app.command("describe")
def robot_describe(
    overrides: Overrides = None, as_json: Json = False, home: Home = None, config_dir: ConfigDir = None
) -> int:
    """Show what is read of a robot's description: joints, tip, limits and their sources, what is assumed or missing.

    Example: kendama robot describe robot=ur5
    """
    from kendama_cli.cli.describe import describe  # dartpy

    return describe(find_site(home, config_dir), overrides or [], as_json=as_json)


@robot_app.command("check")
def robot_check(
    overrides: Overrides = None,
    pipeline: PipelineName = "imitation",
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> int:
    """Check the imitated swing against limits, stops, gaps, table and workspace, with margins; nothing moves.

    Example: kendama robot check robot=ur5
    """
    from kendama_cli.cli.check import check  # dartpy and compiled code

    return check(find_site(home, config_dir), pipeline, overrides or [], as_json=as_json)


@robot_app.command("recover")
def robot_recover(
    overrides: Overrides = None,
    arm: Arm = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Take a robot out of its latched stop, and say where it stands; it does not move before the next run.

    Example: kendama robot recover hardware=udp --arm
    """
    from kendama_cli.cli.check import recover  # dartpy

    recover(find_site(home, config_dir), overrides or [], armed=arm)


@robot_app.command("twin")
def robot_twin(
    overrides: Overrides = None,
    host: Annotated[str, typer.Option(help="Address to bind; loopback unless you say otherwise.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="UDP port; 0 takes a free one.")] = 0,
    key_file: Annotated[
        str, typer.Option(metavar="FILE", help="Key that whoever commands it must have (kendama robot key).")
    ] = KEY_FILE,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Run the simulated robot as a process of its own, behind UDP, until it is stopped.

    Example: kendama robot twin --port 5005
    """
    from kendama_cli.config.compose import composed
    from kendama_cli.devices.robot.udp.seal import read_key  # dartpy
    from kendama_cli.devices.robot.udp.twin import serve_twin
    from kendama_cli.pipeline.inputs import resolve_files
    from kendama_cli.pipeline.nodes import build_settings

    site = find_site(home, config_dir)
    settings = build_settings(composed(site, overrides or []))
    if settings["hardware"].kind != "twin":
        raise UsageError(f"hardware is '{settings['hardware'].kind}'; a twin needs hardware=twin")
    secret = read_key(key_file)
    robot = resolve_files(settings["robot"], "robot", site.data_roots)
    serve_twin(robot, settings["game"], settings["hardware"], secret, host=host, port=port, on_ready=render.line)


@robot_app.command("place")
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
    from kendama_cli.cli.place import PlaceOptions, place  # dartpy and compiled code

    options = PlaceOptions(output, line, effort, as_json)
    place(find_site(home, config_dir), pipeline, overrides or [], options)
