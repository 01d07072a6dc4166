"""Commands that calibrate cameras, and measure their delay and their place for a setup.yaml."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli.options import ConfigDir, Home, Json, Overrides
from kendama_cli.cli.setup import SetupFile
from kendama_cli.config.site import find_site

Squares = Annotated[str, typer.Option("--board", metavar="COLUMNSxROWS", help="Squares, circles or tags.")]
SquareMm = Annotated[float, typer.Option(metavar="MM", help="Side of a square, as measured on the print.")]
MarkerMm = Annotated[float, typer.Option(metavar="MM", help="Side of a marker.")]
BoardKind = Annotated[
    str,
    typer.Option(
        metavar="KIND", help="auto, charuco, chessboard, circles, staggered (asymmetric circles) or tags (AprilTags)."
    ),
]
RegionOption = Annotated[
    str | None,
    typer.Option("--region", metavar="X,Y,W,H", help="Part of the image with the light [px]; else all of it."),
]


def camera_board(
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="The picture to print: .pdf or .png.")
    ] = Path("board.pdf"),
    squares: Squares = "7x5",
    square_mm: SquareMm = 30.0,
    marker_mm: MarkerMm = 22.0,
) -> None:
    """Make a ChArUco board to print in the size that the options say: as PDF unscaled, as PNG at 300 dpi.

    Example: kendama camera board -o board.pdf
    """
    from kendama_cli.plugins.calibration.boards import board_of, draw_board  # OpenCV

    draw_board(board_of(squares, square_mm, marker_mm), output)


def camera_calibrate(
    paths: Annotated[
        list[Path],
        typer.Argument(metavar="PATH...", help="Per camera a folder of images, or a video; its name is the camera's."),
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="The calibration; a picture of it goes beside it.")
    ] = Path("calibration.yaml"),
    squares: Squares = "7x5",
    square_mm: SquareMm = 30.0,
    marker_mm: MarkerMm = 22.0,
    board_kind: BoardKind = "auto",
    board_at: Annotated[
        str, typer.Option(metavar="X,Y,Z", help="The world's place [m] of the board's middle in the first view.")
    ] = "0,0,0",
    as_json: Json = False,
) -> None:
    """Calibrate one or several cameras from views of a board.

    Views of one name (or one place in their videos) were taken at one moment. In the first view of the first camera the
    board lies print up, its rows along the world's x.

    Example: kendama camera calibrate left=left.mp4 right=right.mp4 -o cameras.yaml
    """
    from kendama_cli.plugins.calibration.boards import (  # OpenCV
        CalibrationRequest,
        board_of,
        calibrate_cameras,
        kinds_of,
    )

    board, kinds = board_of(squares, square_mm, marker_mm), kinds_of(board_kind)
    request = CalibrationRequest(board, kinds, tuple(paths), board_at)
    calibrate_cameras(request, output, as_json=as_json)


def camera_blink(
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="The page to open in a browser.")
    ] = Path("blink.html"),
) -> None:
    """Write a page that blinks at random and then offers when it did: a light for 'camera latency'.

    Example: kendama camera blink -o blink.html
    """
    from kendama_cli.plugins.calibration.setup import write_page

    write_page(output)


def camera_brightness(
    overrides: Overrides = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="A row per image: t_s,brightness.")
    ] = Path("brightness.csv"),
    seconds: Annotated[float, typer.Option(metavar="N", min=1.0, help="Duration of the recording.")] = 35.0,
    region: RegionOption = None,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Look through the first configured live camera, and write how bright each image is and when it came.

    Example: kendama camera brightness camera=device -o brightness.csv
    """
    from kendama_cli.plugins.calibration.setup import record_brightness

    record_brightness(find_site(home, config_dir), overrides or [], output, seconds, region)


def camera_latency(
    film: Annotated[
        Path, typer.Argument(metavar="FILM|CSV", help="A film of the light, or what 'camera brightness' wrote.")
    ],
    blinks: Annotated[
        Path, typer.Argument(metavar="BLINKS", help="Times at which the light switched: CSV with t_s; off first.")
    ],
    stamps: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Times of a film's frames: CSV with t_s, on one clock.")
    ] = None,
    region: RegionOption = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Keep it in this setup.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Measure a camera's delay, from mid-exposure to an image's stamp, by a light whose switching is known.

    Example: kendama camera latency film.mp4 blinks.csv
    """
    from kendama_cli.plugins.calibration.setup import measure_latency

    measure_latency(film, blinks, stamps, region, output, as_json=as_json)


def camera_place(
    paths: Annotated[
        list[Path], typer.Argument(metavar="PATH...", help="Per camera a folder of images of a board on the hand.")
    ],
    calibration: Annotated[
        Path,
        typer.Option(metavar="FILE", help="Calibration by 'camera calibrate'; camera names must match folder names."),
    ],
    poses: Annotated[Path, typer.Option(metavar="FILE", help="CSV: view (an image's name), then the hand's pose.")],
    robot: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The poses are joint angles of this robot (conf/robot/NAME.yaml)."),
    ] = None,
    link: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="The cameras are on this link, the poses are the link's, and the board stands still."
        ),
    ] = None,
    output: SetupFile = Path("setup.yaml"),
    squares: Squares = "7x5",
    square_mm: SquareMm = 30.0,
    marker_mm: MarkerMm = 22.0,
    board_kind: BoardKind = "auto",
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Find where calibrated cameras stand in a robot's world, from a board that its hand turns before them.

    With --link, find where they are on a link of the arm, from a board that stands still.

    Example: kendama camera place view.png --calibration cameras.yaml --poses poses.csv
    """
    from kendama_cli.plugins.calibration.boards import board_of, kinds_of
    from kendama_cli.plugins.calibration.setup import PlaceRequest, place_in_robot

    board, kinds = board_of(squares, square_mm, marker_mm), kinds_of(board_kind)
    request = PlaceRequest(tuple(paths), calibration, poses, robot, link, board, kinds)
    place_in_robot(find_site(home, config_dir), request, output, as_json=as_json)
