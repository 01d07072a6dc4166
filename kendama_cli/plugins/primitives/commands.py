"""The commands for movement primitives: look at one, take it out of the store, draw swings from its distribution."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli import completion
from kendama_cli.cli.groups import open_group
from kendama_cli.cli.options import Home, Json

SECTION = "Look"
motion_app = typer.Typer(
    cls=open_group("motion"), help="Movement primitives: show, export, draw from.", no_args_is_help=True
)

Source = Annotated[
    str | None,
    typer.Argument(
        metavar="[SOURCE]",
        help="A run's id, an artifact's folder, or FILE.yaml|.json; the newest run that has a primitive if left out.",
        autocompletion=completion.runs,
    ),
]
Stage = Annotated[
    str | None,
    typer.Option(
        metavar="STAGE",
        help="The stage that gave it: encode the average of the demonstrations, adapt the one that an arm plays; the "
        "first of the run that gave one if left out.",
        autocompletion=completion.stages,
    ),
]


@motion_app.command("show")
def motion_show(source: Source = None, stage: Stage = None, as_json: Json = False, home: Home = None) -> None:
    """Show a primitive: duration, start, goal, weights, and the deviations of its demonstrations.

    Example: kendama motion show 1
    """
    from kendama_cli.plugins.primitives.work import show

    show(source, stage, home, as_json=as_json)


@motion_app.command("export")
def motion_export(
    source: Source = None,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="FILE.yaml or FILE.json.")] = Path(
        "motion.yaml"
    ),
    stage: Stage = None,
    home: Home = None,
) -> None:
    """Write a primitive as YAML or JSON, exact to the last bit; encode.plan=FILE takes it up again.

    Example: kendama motion export 1 -o swing.yaml
    """
    from kendama_cli.plugins.primitives.work import export

    export(source, stage, home, output)


@motion_app.command("sample")
def motion_sample(
    source: Source = None,
    count: Annotated[int, typer.Option("-n", "--count", metavar="N", min=1, help="Number of swings to sample.")] = 1,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="FILE.yaml or .json; numbered where N > 1.")
    ] = Path("sample.yaml"),
    scale: Annotated[float, typer.Option(metavar="S", min=0.0, help="Standard deviations are S times as large.")] = 1.0,
    seed: Annotated[int, typer.Option(metavar="SEED", min=0, help="The same seed draws the same swings.")] = 0,
    stage: Stage = None,
    home: Home = None,
) -> None:
    """Draw perturbed swings from the distribution that the demonstrations spanned.

    Example: kendama motion sample 1 -n 10 -o swings
    """
    from kendama_cli.plugins.primitives.work import sample

    sample(source, stage, home, output, count=count, scale=scale, seed=seed)
