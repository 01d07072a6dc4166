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
    surface: Annotated[
        bool, typer.Option("--surface", help="The rope ends on the ball's surface, not in its centre.")
    ] = False,
    spin_hz: Annotated[float, typer.Option(metavar="HZ", min=-20, max=20, help="First spin of the ball.")] = 0.0,
    rigid: Annotated[bool, typer.Option("--rigid", help="The cup does not recoil from the ball.")] = False,
    restitution: Annotated[
        float | None, typer.Option(metavar="E", min=0, max=0.9, help="Restitution of the ball [as in the run].")
    ] = None,
    as_json: Json = False,
    home: Home = None,
) -> None:
    """Play a run's games again on a chain of links in MuJoCo, and say whether it agrees (extra 'mujoco').

    Example: kendama cross-check 12
    """
    from kendama_cli.plugins.mujoco.cross_check.chain import Variation  # numpy, scipy and MuJoCo
    from kendama_cli.plugins.mujoco.cross_check.games_again import referee as play_again

    rope_kg = None if rope_g is None else 1e-3 * rope_g
    play_again(
        find_site(home).home, run_name, Variation(rope_kg, restitution, surface, spin_hz, rigid), as_json=as_json
    )
