"""Work of ``camera colour`` and ``camera check``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from kendama_cli.cli import render
from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site
from kendama_cli.errors import InputError, StageError, UsageError
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.plugins.cameras.check import check_cameras, figures
from kendama_cli.plugins.cameras.colour_learning import learn_from_clicks
from kendama_cli.plugins.shared.videos.pictures import as_png, check_picture
from kendama_cli.plugins.shared.videos.views import cameras_of, read_views


def learn_ball(clicks: Sequence[str], radius_px: float, output: Path) -> None:
    """Learn the ball's colour where ``clicks``, IMAGE@U,V each, point at it, and write it.

    Raises UsageError for a click that is none or lies outside its image, InputError where nothing can be learned.
    """
    refuse_output(output, "a learned colour is JSON", ".json")
    images, places = [], []
    for click in clicks:
        name, _, place = click.rpartition("@")
        try:
            u, v = (float(part) for part in place.split(","))
        except ValueError:
            raise UsageError(f"{click}: give an image and the ball's middle in it, such as left.png@320,200") from None
        (_, pixels), *_ = read_views([path for paths in cameras_of([Path(name)]).values() for path in paths])
        if not (0 <= u < pixels.shape[1] and 0 <= v < pixels.shape[0]):
            size = f"{pixels.shape[1]} x {pixels.shape[0]} px"
            raise UsageError(f"{click}: the place lies outside the image of {size}; u counts columns, v rows")
        images.append(pixels)
        places.append((u, v))
    try:
        learned = learn_from_clicks(images, places, radius_px)
    except ValueError as error:
        raise InputError(", ".join(clicks), str(error), remedy="point at the ball in a well lit image") from None
    write_output(output, learned.to_json().encode())
    render.text(f"{output}; use it with predict.detector.colour={output}")


def check(site: Site, overrides: Sequence[str], seconds: float, output: Path | None, *, as_json: bool) -> None:
    """Look through the configured cameras, and show what they give and what the detector sees in it."""
    if output is not None:
        refuse_output(output, "a picture is a PNG", ".png")
    settings = build_settings(composed(site, overrides))
    records = check_cameras(
        resolve_files(settings["camera"], "camera", site.data_roots),
        settings["lighting"],
        settings["game"],
        resolve_files(settings["predict"], "predict", site.data_roots),
        seconds=seconds,
        seed=settings["seed"],
    )
    reported = {name: figures(one) for name, one in records.items()}
    shown = {name: one.shown for name, one in records.items() if one.shown is not None}
    if not shown:
        raise StageError(f"no camera gave a frame within {seconds:g} s; look longer, or check the recording's times")
    if output is not None:
        write_output(output, as_png(check_picture(shown)))
    if as_json:
        render.document({"cameras": reported, "picture": None if output is None else str(output)})
        return
    names = next(iter(reported.values()))
    render.table(
        [(name, *(render.figure(one[name]) for one in reported.values())) for name in names], head=("", *reported)
    )
