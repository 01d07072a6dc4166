"""The commands that print settings and tell what they mean."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli import completion
from kendama_cli.cli.options import ConfigDir, Home, Json
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

    Example: kendama config learn robot=ur5
    """
    site = find_site(home, config_dir)
    if migrate is not None:
        brought("--migrate", "kendama.migrations", "settings")(site, migrate)
        return
    from kendama_cli.cli.run_work import show_configuration

    words = overrides or []
    show_configuration(site, [one for one in words if "=" in one], [one for one in words if "=" not in one])


def explain(
    names: Annotated[
        list[str],
        typer.Argument(
            metavar="NAME...", help="Keys, metrics, stages, topics or figures.", autocompletion=completion.explained
        ),
    ],
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Explain settings, metrics, stages, topics or figures.

    Example: kendama explain learn.alpha
    """
    from kendama_cli.cli.explain import explain as explain_names

    explain_names(find_site(home, config_dir), names, as_json=as_json)
