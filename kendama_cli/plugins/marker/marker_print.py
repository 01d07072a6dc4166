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

PRINT_DPI = 300
MM_PER_INCH, POINTS_PER_INCH = 25.4, 72.0


def print_marker(dictionary: str, number: int, size_mm: float, output: Path) -> None:
    """Write the marker with its white edge of one cell as PNG (300 dpi), SVG or PDF; raises UsageError."""
    if dictionary not in DICTIONARIES:
        raise UsageError(f"--dictionary {dictionary}: allowed are {', '.join(DICTIONARIES)}")
    count = marker_count(dictionary)
    if not 0 <= number < count:
        raise UsageError(f"--number {number}: {dictionary} has the markers 0 to {count - 1}")
    black = black_cells(dictionary, number)
    writers = {".png": _png, ".svg": _svg, ".pdf": _pdf}
    refuse_output(output, f"allowed are {', '.join(writers)}", *writers)
    write_output(output, writers[output.suffix.lower()](black, size_mm))
    render.prose(
        f"{output}: marker {number} of {dictionary}; print it unscaled and measure the black square, which should be "
        f"{size_mm:g} mm: capture.dictionary={dictionary} capture.number={number} capture.size_m={size_mm / 1e3:g}"
    )


def _squares(black: NDArray[np.bool_], size_mm: float) -> tuple[list[tuple[float, float]], float, float]:
    """Return upper left corners of the black cells, a cell's side and the whole side with the white edge [mm]."""
    cell = size_mm / len(black)
    places = [((column + 1) * cell, (row + 1) * cell) for row, column in np.argwhere(black).tolist()]
    return places, cell, size_mm + 2 * cell


def _svg(black: NDArray[np.bool_], size_mm: float) -> bytes:
    places, cell, whole = _squares(black, size_mm)
    # a hair wider, or viewers leave seams between cells
    cells = "".join(f'<rect x="{x:.4f}" y="{y:.4f}" width="{cell:.4f}" height="{cell:.4f}"/>' for x, y in places)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{whole:.4f}mm" height="{whole:.4f}mm" '
        f'viewBox="0 0 {whole:.4f} {whole:.4f}" shape-rendering="crispEdges">'
        f'<rect width="100%" height="100%" fill="#fff"/>{cells}</svg>\n'
    ).encode()


def _pdf(black: NDArray[np.bool_], size_mm: float) -> bytes:
    """Return one page of the marker's size (PDF 32000-1:2008): filled rectangles in millimetres."""
    places, cell, whole = _squares(black, size_mm)
    scale = POINTS_PER_INCH / MM_PER_INCH
    drawn = [f"{scale:.6f} 0 0 {scale:.6f} 0 0 cm"]
    drawn += [f"{x:.4f} {whole - y - cell:.4f} {cell:.4f} {cell:.4f} re f" for x, y in places]
    stream = "\n".join(drawn).encode()
    side = whole * scale
    bodies = [
        b"<< /Type /Catalog /Pages 2 0 R >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {side:.4f} {side:.4f}] /Contents 4 0 R >>".encode(),
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(stream), stream),
    ]
    made, begins = b"%PDF-1.4\n", []
    for place, body in enumerate(bodies, start=1):
        begins.append(len(made))
        made += b"%d 0 obj\n%s\nendobj\n" % (place, body)
    table = b"".join(b"%010d 00000 n \n" % begin for begin in begins)
    head = b"xref\n0 %d\n0000000000 65535 f \n%s" % (len(bodies) + 1, table)
    return made + head + b"trailer << /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (len(bodies) + 1, len(made))


def _png(black: NDArray[np.bool_], size_mm: float) -> bytes:
    side = max(round(size_mm / MM_PER_INCH * PRINT_DPI / len(black)), 1)
    edged = np.pad(np.where(black, 0, 255).astype(np.uint8), 1, constant_values=255)
    # the resolution is that at which a whole number of pixels makes the declared size
    density = round(side * len(black) / size_mm * 1e3)
    coded = as_png(np.kron(edged, np.ones((side, side), np.uint8)))
    chunk = b"pHYs" + density.to_bytes(4, "big") * 2 + b"\1"
    physical = (9).to_bytes(4, "big") + chunk + zlib.crc32(chunk).to_bytes(4, "big")
    return coded[:33] + physical + coded[33:]
