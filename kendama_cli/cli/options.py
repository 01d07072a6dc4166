"""The options and arguments that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli import completion

Home = Annotated[
    Path | None, typer.Option("--home", metavar="DIR", help="Store, runs and logs [KENDAMA_HOME, else .kendama].")
]
ConfigDir = Annotated[
    Path | None, typer.Option("--config-dir", metavar="DIR", help="A folder with conf/ and pipelines/ of your own.")
]
PipelineName = Annotated[
    str,
    typer.Option("-p", "--pipeline", metavar="PIPELINE", help="Pipeline to run.", autocompletion=completion.pipelines),
]
Until = Annotated[
    str | None,
    typer.Option(metavar="STAGE", help="Stop after this stage.", autocompletion=completion.stages),
]
Force = Annotated[
    list[str] | None,
    typer.Option(
        metavar="STAGE", help="Compute this stage again even where it is cached.", autocompletion=completion.stages
    ),
]
On = Annotated[
    str | None,
    typer.Option(
        "--on",
        metavar="EXECUTOR",
        help="Executor of the stages: local, dask or slurm [executor of the configuration].",
        autocompletion=completion.executors,
    ),
]
Thorough = Annotated[
    bool, typer.Option("--thorough", help="Play every evaluation to its end, also where its rate is clear earlier.")
]
RemotePlace = Annotated[
    str | None,
    typer.Option("--remote", metavar="PLACE", help="A folder, or s3://bucket/prefix [store.remote]."),
]
LogPlace = Annotated[
    str,
    typer.Argument(
        metavar="FILE",
        help="An MCAP file, or RUN/STAGE, or STAGE of the newest run that has it.",
        autocompletion=completion.artifacts,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document.")]
Arm = Annotated[bool, typer.Option("--arm", help="Allow stages that move real hardware.")]
Overrides = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="KEY=VALUE", help="Values of the configuration that differ.", autocompletion=completion.overrides
    ),
]


def words(overrides: list[str] | None, *, thorough: bool) -> list[str]:
    """Return the overrides as they were typed, and the one that ``--thorough`` stands for."""
    return [*(overrides or []), *(["transfer.thorough=true"] if thorough else [])]
