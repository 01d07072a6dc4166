"""Commands that train a detector, find the ball in images, and track it through films."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli.options import ConfigDir, Home, Json
from kendama_cli.config.site import find_site
from kendama_cli.errors import UsageError

Teach = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER", help="Images with boxes about the ball (images/, labels/): teach the ball by them."),
]
DetectorName = Annotated[
    str | None,
    typer.Option("--detector", metavar="NAME", help="trained, colour, ... [trained, by --train or --box]"),
]
DetectorSettingsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--override", metavar="KEY=VALUE", help="A setting of the detector, such as predict.detector.hue_high=30."
    ),
]
Seed = Annotated[int, typer.Option(metavar="N", min=0, help="Seed of the training.")]


def camera_train(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="FILM|FOLDER", help="A film to draw boxes in, or 3 to 10 images with boxes: images/ and labels/."
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="PATH",
            help="For a video, the folder of images and boxes [FILM-boxes]; for a folder, the trained ball [ball.npz].",
        ),
    ] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="TCP port of the page; 0 takes a free one.")] = 0,
    show: Annotated[bool, typer.Option("--show/--no-show", help="Open the page in the browser.")] = True,
    cup: Annotated[
        bool, typer.Option("--cup", help="Draw boxes of the cup too, for capture=video; all lie beside the video.")
    ] = False,
    seed: Seed = 0,
) -> None:
    """Show what the ball looks like: draw boxes about it in stills of a film, on a page in the browser.

    With a folder of images that have boxes already: learn the ball once, for predict/detector=trained.

    Example: kendama camera train film.mp4 -o ball
    """
    if path.is_dir():
        from kendama_cli.plugins.films.detect import train_ball  # OpenCV

        train_ball(path, output or Path("ball.npz"), seed)
        return
    from kendama_cli.plugins.films.draw import PageOptions, boxes_folder, draw_ball_and_cup, draw_boxes  # OpenCV

    if cup:
        if output is not None:
            raise UsageError("--cup and -o: boxes of ball and cup lie beside the video; leave out one of the two")
        draw_ball_and_cup(path, PageOptions(port, show))
        return
    draw_boxes(path, output or boxes_folder(path), PageOptions(port, show))


def camera_detect(
    images: Annotated[list[Path], typer.Argument(metavar="IMAGES...", help="Images, or folders of images.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="A row per sighting: file,u_px,v_px,radius_px,score.")
    ] = Path("found.csv"),
    train: Teach = None,
    detector: DetectorName = None,
    override: DetectorSettingsOption = None,
    balls: Annotated[int, typer.Option(metavar="N", min=1, help="Most balls in one image.")] = 1,
    score: Annotated[
        Path | None,
        typer.Option(metavar="LABELS", help="Compare with the boxes in this folder; tell thresholds by precision."),
    ] = None,
    seed: Seed = 0,
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Find the ball in images, each for itself.

    Example: kendama camera detect images/*.png -o ball.csv
    """
    from kendama_cli.plugins.films.detect import SeeingOptions, detect_balls  # OpenCV

    options = SeeingOptions(find_site(home, config_dir), detector, train, seed, tuple(override or ()), balls)
    detect_balls(images, output, options, score, as_json=as_json)


def camera_track(
    videos: Annotated[list[Path], typer.Argument(metavar="VIDEO...", help="A film per camera.")],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="FILE", help="The track: a row per frame with the ball."),
    ] = Path("throws.csv"),
    calibration: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Calibration by 'camera calibrate'; camera names must match video names."),
    ] = None,
    ball_mm: Annotated[
        float | None, typer.Option(metavar="MM", min=1.0, help="The ball's diameter: one camera sees depth by it.")
    ] = None,
    train: Teach = None,
    box: Annotated[
        list[str] | None,
        typer.Option(metavar="FRAME:X,Y,W,H", help="Teach the ball by a box in the first film [px]; repeat, 3 to 10."),
    ] = None,
    detector: DetectorName = None,
    override: DetectorSettingsOption = None,
    same_clock: Annotated[
        bool, typer.Option("--same-clock", help="The films begin at one moment; else that is found from the ball.")
    ] = False,
    overlay: Annotated[
        Path | None, typer.Option(metavar="FILM", help="The first film with the track drawn in (.webm).")
    ] = None,
    seed: Seed = 0,
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Track the ball through films: in pixels, and in metres where the cameras are calibrated.

    Without --train, --box and --detector it opens the page of 'kendama camera train' first.

    Example: kendama camera track swing.mp4 -o track.csv
    """
    from kendama_cli.plugins.films.detect import SeeingOptions  # OpenCV
    from kendama_cli.plugins.films.track import TrackOptions, track_films

    seeing = SeeingOptions(find_site(home, config_dir), detector, train, seed, tuple(override or ()))
    track_films(
        videos,
        output,
        seeing,
        TrackOptions(calibration, ball_mm, tuple(box or ()), same_clock, overlay),
        as_json=as_json,
    )
