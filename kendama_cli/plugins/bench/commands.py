"""``kendama bench``: our learners in environments of others."""

from __future__ import annotations

from typing import Annotated

import typer

from kendama_cli.cli.options import Home, Json

SECTION = "Look"
"""Part of ``kendama --help`` in which these commands stand."""


def bench(
    environments: Annotated[
        list[str], typer.Argument(metavar="ENV... [OVERRIDE...]", help="Registered names; and bench.KEY=VALUE.")
    ],
    learner: Annotated[str, typer.Option(metavar="NAME", help="Update of the table, sarsa or q.")] = "sarsa",
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="Seeds 0 to N-1.")] = 10,
    as_json: Json = False,
    home: Home = None,
) -> None:
    """Learn in environments of Gymnasium, and compare each policy with its own exploration (extra 'gym').

    Example: kendama bench CartPole-v1 MountainCar-v0
    """
    from kendama_cli.plugins.bench.learn_on import compare  # numpy, scipy and Gymnasium

    names = [word for word in environments if "=" not in word]
    overrides = [word for word in environments if "=" in word]
    compare(names, learner, range(seeds), overrides, home=home, as_json=as_json)
