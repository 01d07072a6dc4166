"""``kendama cross-check``: a run's games again under another physics."""

from __future__ import annotations

from typing import Annotated

import typer

from kendama_cli.cli import completion
from kendama_cli.cli.options import Home, Json
from kendama_cli.config.site import find_site

SECTION = "Look"
"""Part of ``kendama --help`` in which these commands stand."""


def referee(
    run_name: Annotated[
        str | None,
        typer.Argument(metavar="[RUN]", help="Id of a run; the newest if left out.", autocompletion=completion.runs),
    ] = None,
    rope_g: Annotated[
        float | None,
        typer.Option(
            metavar="G", min=0.01, max=20, help="Mass of the whole rope [as in the run; 0.05 if it had none]."
        ),
    ] = None,
    as_json: Json = False,
    home: Home = None,
) -> None:
    """Play a run's games again on a chain of links in MuJoCo, and say whether it agrees (extra 'mujoco').

    Example: kendama cross-check 12
    """
    from kendama_cli.plugins.mujoco.cross_check.games_again import referee as play_again  # numpy, scipy and MuJoCo

    play_again(find_site(home).home, run_name, rope_kg=None if rope_g is None else 1e-3 * rope_g, as_json=as_json)
