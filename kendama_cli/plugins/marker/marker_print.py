"""``kendama camera marker``: the marker as a picture to print, in its true size."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kendama_cli.cli import render
from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.errors import UsageError
from kendama_cli.plugins.marker.detection import DICTIONARIES, black_cells, marker_count
from kendama_cli.plugins.shared.videos.pictures import as_png
from kendama_cli.plugins.shared.videos.printed import as_pdf, page_of

PRINT_DPI = 300
MM_PER_INCH = 25.4
PDF_PIXELS = 80
"""Side of a cell in the picture of a page."""


def print_marker(dictionary: str, number: int, size_mm: float, output: Path) -> None:
    """Write the marker with its white edge of one cell as PNG (300 dpi) or PDF; raises UsageError."""
    if dictionary not in DICTIONARIES:
        raise UsageError(f"--dictionary {dictionary}: allowed are {', '.join(DICTIONARIES)}")
    count = marker_count(dictionary)
    if not 0 <= number < count:
        raise UsageError(f"--number {number}: {dictionary} has the markers 0 to {count - 1}")
    black = black_cells(dictionary, number)
    writers = {".png": _png, ".pdf": _pdf}
    refuse_output(output, f"allowed are {', '.join(writers)}", *writers)
    write_output(output, writers[output.suffix.lower()](black, size_mm))
    render.prose(
        f"{output}: marker {number} of {dictionary}; print it unscaled and measure the black square, which should be "
        f"{size_mm:g} mm: capture.dictionary={dictionary} capture.number={number} capture.size_m={size_mm / 1e3:g}"
    )


def _pdf(black: NDArray[np.bool_], size_mm: float) -> bytes:
    """Return one page of the marker's size, its white edge included."""
    whole_m = size_mm / 1e3 * (1 + 2 / len(black))
    return as_pdf(page_of(_edged(black, PDF_PIXELS), whole_m, whole_m))


def _edged(black: NDArray[np.bool_], pixels: int) -> NDArray[np.uint8]:
    """Return the cells, of so many ``pixels`` a side, with a white edge of one cell."""
    edged = np.pad(np.where(black, 0, 255).astype(np.uint8), 1, constant_values=255)
    return np.kron(edged, np.ones((pixels, pixels), np.uint8))


def _png(black: NDArray[np.bool_], size_mm: float) -> bytes:
    side = max(round(size_mm / MM_PER_INCH * PRINT_DPI / len(black)), 1)
    # the resolution is that at which a whole number of pixels makes the declared size
    density = round(side * len(black) / size_mm * 1e3)
    coded = as_png(_edged(black, side))
    chunk = b"pHYs" + density.to_bytes(4, "big") * 2 + b"\1"
    physical = (9).to_bytes(4, "big") + chunk + zlib.crc32(chunk).to_bytes(4, "big")
    return coded[:33] + physical + coded[33:]
