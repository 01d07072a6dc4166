"""``kendama log layout``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli import render
from kendama_cli.cli.options import Home, LogPlace
from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.config.site import find_site


def log_layout(
    file: LogPlace,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="[the log's or stage's name .layout.json].")
    ] = None,
    home: Home = None,
) -> None:
    """Write a layout with which Foxglove shows an MCAP log: scene, images and plots.

    Example: kendama log layout 12/adapt -o adapt.layout.json
    """
    from kendama_cli.pipeline.artifact_place import log_path
    from kendama_cli.plugins.watch.layout import layout  # pandas

    target = output or Path(Path(file).stem + ".layout.json")
    refuse_output(target, "a layout is JSON", ".json")
    made = json.dumps(layout(log_path(find_site(home).home, file)), indent=1)
    write_output(target, f"{made}\n".encode())
    render.text(str(target))
