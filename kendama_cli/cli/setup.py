"""The commands about a laboratory's setup.yaml: what a run has measured goes into it, and what it holds is shown."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli import completion
from kendama_cli.cli.groups import open_group
from kendama_cli.cli.options import Home, Json
from kendama_cli.config.site import find_site

setup_app = typer.Typer(
    cls=open_group("setup"), help="Measured values of a laboratory, in one file: setup.yaml.", no_args_is_help=True
)

SetupFile = Annotated[
    Path, typer.Option("-o", "--output", metavar="FILE", help="The setup; what else it holds is kept.")
]


@setup_app.command("kendama")
def setup_toy(
    run: Annotated[
        str | None,
        typer.Argument(metavar="[RUN]", help="A run with the stage measure.", autocompletion=completion.runs),
    ] = None,
    output: SetupFile = Path("setup.yaml"),
    home: Home = None,
) -> None:
    """Keep the rope and the drag that a run of the pipeline measurement has measured.

    Example: kendama setup kendama 12 -o setup.yaml
    """
    from kendama_cli.cli.setup_work import keep_toy  # numpy

    keep_toy(find_site(home), run, output)


@setup_app.command("show")
def setup_show(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A setup.")] = Path("setup.yaml"), as_json: Json = False
) -> None:
    """Show what a setup holds, with intervals of 95 %.

    Example: kendama setup show setup.yaml
    """
    from kendama_cli.cli.setup_work import show_setup

    show_setup(file, as_json=as_json)
