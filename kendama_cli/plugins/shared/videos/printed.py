"""Pictures on a page of their true size, to print."""

from __future__ import annotations

import io

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

INCH_M = 0.0254


def page_of(picture: NDArray[np.uint8], width_m: float, height_m: float, below_m: float = 0.0) -> Figure:
    """Return a page with the grey ``picture`` and ``below_m`` of white below it, and axes over all of it in metres."""
    whole_m = height_m + below_m
    page = Figure(figsize=(width_m / INCH_M, whole_m / INCH_M))
    axes = page.add_axes((0, 0, 1, 1), xlim=(0, width_m), ylim=(0, whole_m))
    axes.axis("off")
    edges = (0, width_m, below_m, whole_m)
    axes.imshow(picture, cmap="gray", vmin=0, vmax=255, extent=edges, interpolation="none", aspect="auto")
    return page


def as_pdf(page: Figure) -> bytes:
    """Return ``page`` as the content of a file."""
    file = io.BytesIO()
    page.savefig(file, format="pdf", metadata={"CreationDate": None})
    return file.getvalue()
