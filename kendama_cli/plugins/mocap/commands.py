"""The commands about the hand: where the cup is in a tracked body."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli import render
from kendama_cli.cli.options import Json
from kendama_cli.errors import InputError

SECTION = "Record"
"""Part of ``kendama --help`` in which these commands stand."""

capture_app = typer.Typer(help="Prepare recordings of the hand.", no_args_is_help=True)


@capture_app.callback()
def capture() -> None:
    """Prepare recordings of the hand."""


@capture_app.command("pivot")
def capture_pivot(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="A recording of the body turned about the point.")],
    body: Annotated[str | None, typer.Option(metavar="NAME", help="The rigid body; the only one otherwise.")] = None,
    setup: Annotated[Path | None, typer.Option(metavar="FILE", help="Keep it in this setup.")] = None,
    as_json: Json = False,
) -> None:
    """Find the cup's tie point in a tracked body.

    Hold the point still (in a hole, on a tip) and turn the body by 30 degrees or more to all sides for ten seconds.

    Example: kendama capture pivot pivot.csv --body cup
    """
    import numpy as np

    from kendama_cli.cli.setup_work import amended, place
    from kendama_cli.devices.recordings.reader import read_bodies
    from kendama_cli.plugins.mocap.body import named_body
    from kendama_cli.plugins.mocap.pivot import calibrate_pivot

    track = named_body(str(path), {one.name: one for one in read_bodies(str(path))}, body, "body")
    if track.rotation_wxyz is None:
        raise InputError(str(path), f"'{track.name}' has no orientation", remedy="record a rigid body")
    seen = np.isfinite(np.hstack((track.position_m, track.rotation_wxyz))).all(axis=1)
    if seen.sum() < 20:
        raise InputError(str(path), f"'{track.name}' is seen in {seen.sum()} samples", remedy="record it again")
    try:
        made = calibrate_pivot(track.position_m[seen], track.rotation_wxyz[seen])
    except ValueError as wrong:
        raise InputError(str(path), str(wrong), remedy="record it again") from None
    if setup is not None:
        source = f"pivot of {path.name}, {1e3 * made.rms_m:.2f} mm left"
        amended(setup, body_to_cup_m=place(made.offset_m.tolist(), made.sigma_m.tolist(), source))
    offset = [round(float(value), 5) for value in made.offset_m]
    if as_json:
        render.document(
            {
                "body_to_cup_m": offset,
                "sigma_m": [float(value) for value in made.sigma_m],
                "rms_m": made.rms_m,
                "samples": made.used,
            }
        )
        return
    sigma = " ".join(f"{1e3 * value:.2f}" for value in made.sigma_m)
    render.text(f"capture.body_to_cup_m=[{','.join(f'{value:g}' for value in offset)}]")
    render.text(f"residual {1e3 * made.rms_m:.2f} mm rms over {made.used} samples; offset known to +-{sigma} mm")
