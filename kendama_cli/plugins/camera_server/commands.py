"""The command that serves cameras."""

from __future__ import annotations

from typing import Annotated

import typer

from kendama_cli.cli import render
from kendama_cli.cli.options import ConfigDir, Home, Overrides
from kendama_cli.cli.robot import KEY_FILE
from kendama_cli.config.site import find_site
from kendama_cli.errors import UsageError


def camera_serve(
    overrides: Overrides = None,
    host: Annotated[str, typer.Option(help="Address to bind; loopback unless you say otherwise.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="TCP port; 0 takes a free one.")] = 47710,
    key_file: Annotated[
        str, typer.Option(metavar="FILE", help="Key that whoever looks through them must have (kendama robot key).")
    ] = KEY_FILE,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Serve live cameras to another process or machine, until it is stopped.

    Example: kendama camera serve camera=device --port 47710
    """
    from kendama_cli.config.compose import composed
    from kendama_cli.devices.robot.udp.seal import read_key
    from kendama_cli.pipeline.inputs import resolve_files
    from kendama_cli.pipeline.nodes import build_settings
    from kendama_cli.plugins.camera_server.server import serve_cameras

    site = find_site(home, config_dir)
    camera = build_settings(composed(site, overrides or []))["camera"]
    if camera.source != "live":
        raise UsageError(f"camera is '{camera.kind}'; only live cameras are served, as in camera=device")
    camera = resolve_files(camera, "camera", site.data_roots)
    serve_cameras(camera, read_key(key_file), host=host, port=port, on_ready=render.line)
