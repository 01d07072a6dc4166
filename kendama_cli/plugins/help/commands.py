"""``kendama explain`` and ``kendama doctor``."""

from __future__ import annotations

from typing import Annotated

import typer

from kendama_cli.cli import render
from kendama_cli.cli.completion import quietly
from kendama_cli.cli.options import ConfigDir, Home, Json
from kendama_cli.config.site import find_site


@quietly
def explained(incomplete: str) -> list[str]:
    """Return the names that ``kendama explain`` knows."""
    from kendama_cli.plugins.help.explain import names_known

    return names_known()


def explain(
    names: Annotated[
        list[str],
        typer.Argument(metavar="NAME...", help="Keys, metrics, stages, topics or figures.", autocompletion=explained),
    ],
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Explain settings, metrics, stages, topics or figures.

    Example: kendama explain learn.alpha
    """
    from kendama_cli.plugins.help.explain import explain as explain_names

    explain_names(find_site(home, config_dir), names, as_json=as_json)


def doctor(as_json: Json = False) -> int:
    """Show installed and missing packages, and the needs of each optional part.

    Example: kendama doctor
    """
    import dataclasses

    from kendama_cli.plugins.help.doctor import examine  # tries every import

    parts = examine()
    if as_json:
        render.document([dataclasses.asdict(part) for part in parts])
    else:
        render.table([(part.name, part.state, part.detail) for part in parts], head=("part", "state", "detail"))
    return 1 if any(part.state == "missing" for part in parts) else 0
