"""The commands about robots: keys, and the twin."""

from __future__ import annotations

from typing import Annotated

import typer

from kendama_cli.cli import render
from kendama_cli.cli.groups import open_group
from kendama_cli.cli.options import ConfigDir, Home, Overrides
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
