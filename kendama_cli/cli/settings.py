"""The command that prints settings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli import completion
from kendama_cli.cli.options import ConfigDir, Home
from kendama_cli.config.site import find_site
from kendama_cli.schema.registry import brought


def config(
    overrides: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="KEY|KEY=VALUE",
            help="Keys or groups to print, with comments [all], and overrides.",
            autocompletion=completion.overrides,
        ),
    ] = None,
    migrate: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Instead, rewrite a YAML of settings of an older version by today's names."),
    ] = None,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Print the configuration as YAML: all of it, or a key or group.

    Example: kendama config learn robot=iiwa
    """
    site = find_site(home, config_dir)
    if migrate is not None:
        brought("--migrate", "kendama.migrations", "settings")(site, migrate)
        return
    from kendama_cli.cli.run_work import show_configuration

    words = overrides or []
    show_configuration(site, [one for one in words if "=" in one], [one for one in words if "=" not in one])
