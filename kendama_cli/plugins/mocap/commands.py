"""The commands about the hand: the layout of a recording, and where the cup is in a tracked body."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli import render
from kendama_cli.cli.options import ConfigDir, Home, Json
from kendama_cli.errors import InputError

SECTION = "Record"
"""Part of ``kendama --help`` in which these commands stand."""

capture_app = typer.Typer(help="Prepare recordings of the hand.", no_args_is_help=True)


@capture_app.callback()
def capture() -> None:
    """Prepare recordings of the hand."""


@capture_app.command("layout")
def capture_layout(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Recordings with one layout.")],
    yes: Annotated[bool, typer.Option("-y", "--yes", help="Take the best guess and write it, without asking.")] = False,
    name: Annotated[str | None, typer.Option(metavar="NAME", help="Write conf/capture/NAME.yaml.")] = None,
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", min=1, help="Sampling rate, if the file has none.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Draw the path as a PNG or SVG.")
    ] = None,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Guess a recording's columns, units, rate and axes, and write the YAML for it.

    Each guess stands with its evidence. Example: kendama capture layout swing.csv -y
    """
    import sys

    from kendama_cli.cli.output_file import refuse_output, write_output
    from kendama_cli.config.site import find_site
    from kendama_cli.plugins.mocap.layout import guess
    from kendama_cli.plugins.mocap.layout.fit import equals
    from kendama_cli.plugins.mocap.layout.picture import ending_of, picture, sketch

    if output is not None:
        refuse_output(output, "the path is drawn as a PNG or an SVG", ".png", ".svg")
    site, paths = find_site(home, config_dir), [str(file) for file in files]
    found = guess.guess(site, paths, rate)
    equal = equals(found)
    made = guess.layout(site, paths, found[0], equal)
    chosen_name = name or guess.name_for(site, paths[0])
    file = guess.write_yaml(site, chosen_name, made) if yes else None  # before output, which may go to 'head'
    guess.show(made, sketch(made.best.path()))
    asked = not yes and sys.stdin.isatty() and sys.stdout.isatty()
    if asked and equal:
        chosen = typer.prompt("which guess is right", default=1, type=int)
        made = guess.layout(site, paths, [found[0], *equal][max(0, min(chosen - 1, len(equal)))], equal)
    if output is not None:
        title = f"{paths[0]}: {made.best.reading.track}"
        write_output(output, picture(title, made.best.reading.t_s, made.best.path(), ending_of(output)))
        render.text(f"drawn: {output}")
    if file is None and not (asked and typer.confirm(f"write conf/capture/{chosen_name}.yaml", default=True)):
        render.text(f"nothing is written; to write conf/capture/{chosen_name}.yaml, add -y")
        return
    file = file or guess.write_yaml(site, chosen_name, made)
    render.text(f"written: {file}\nnext: kendama run capture={chosen_name}")


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
    from kendama_cli.plugins.mocap.body import named_body
    from kendama_cli.plugins.mocap.pivot import calibrate_pivot
    from kendama_cli.plugins.shared.recordings.reader import read_bodies

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
    render.prose(f"residual {1e3 * made.rms_m:.2f} mm rms over {made.used} samples; offset known to +-{sigma} mm")
