"""``kendama camera colour`` and ``kendama camera check``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli.options import ConfigDir, Home, Json, Overrides
from kendama_cli.config.site import find_site


def camera_colour(
    clicks: Annotated[
        list[str], typer.Argument(metavar="IMAGE@U,V...", help="Images, each with the ball's middle in it [px].")
    ],
    radius_px: Annotated[float, typer.Option(metavar="PX", min=2.0, help="The ball's radius in them.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The learned colour.")] = Path(
        "ball.json"
    ),
) -> None:
    """Learn the ball's colour from images in which one points at it.

    Example: kendama camera colour ball.png@320,240 --radius-px 8 -o ball.json
    """
    from kendama_cli.plugins.cameras.colour_learning import learn_ball  # OpenCV

    learn_ball(clicks, radius_px, output)


def camera_check(
    overrides: Overrides = None,
    seconds: Annotated[float, typer.Option(metavar="N", min=0.05, help="Duration of the look.")] = 2.0,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="A picture of what was seen, as PNG.")
    ] = None,
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Look through the configured cameras: frame rate, latency, and what the detector sees.

    Example: kendama camera check camera=device
    """
    from kendama_cli.plugins.cameras.check import check  # OpenCV and compiled code

    check(find_site(home, config_dir), overrides or [], seconds, output, as_json=as_json)
