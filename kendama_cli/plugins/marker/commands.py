"""``kendama camera marker``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def camera_marker(
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="The picture to print: .pdf or .png.")
    ] = Path("marker.pdf"),
    dictionary: Annotated[
        str, typer.Option(metavar="NAME", help="4x4_50, 5x5_100, apriltag_16h5 or apriltag_36h11.")
    ] = "4x4_50",
    number: Annotated[int, typer.Option(metavar="N", help="Number of the marker in the dictionary.")] = 0,
    size_mm: Annotated[float, typer.Option(metavar="MM", min=5.0, max=500.0, help="Side of the black square.")] = 40.0,
) -> None:
    """Make a marker to print and stick on the cup's handle: capture=marker follows it in films.

    Example: kendama camera marker -o marker.pdf
    """
    from kendama_cli.plugins.marker.marker_print import print_marker  # OpenCV

    print_marker(dictionary, number, size_mm, output)
