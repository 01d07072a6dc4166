"""Checks of a calibration board's views by their residuals, and the messages about those that fail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from kendama_cli.schema.arrays import Array

MOST_RMS = 1.0 / 640
"""Of the image's width: what all views of a flat board leave over at most."""
WORST_VIEW = 2.5
"""Times that: what one of them may leave, unless ..."""
APART = 8.0
"""... the median view leaves an eighth of it or more."""
TOGETHER = 3.0
"""What cameras leave over together, beside what each leaves alone, where their views are of one moment."""
NOISE = 0.25
"""Of ``MOST_RMS``: what may come on top of that."""


class Named(Protocol):
    """A view, as far as it matters here."""

    @property
    def name(self) -> str:
        """Return the name that views taken at one time share."""


def rms(residuals_px: Array) -> float:
    """Return the root mean square length of residuals (n, 2)."""
    return float(np.sqrt((residuals_px**2).sum(axis=1).mean()))


def check_views(name: str, views: Sequence[Named], errors_px: Array, width_px: int) -> None:
    """Raise ValueError where a view of camera ``name``, or all of them, do not show what a flat board shows.

    ``errors_px`` (v,) is the rms that each leaves.
    """
    most, middle = MOST_RMS * width_px, float(np.median(errors_px))
    worst = int(errors_px.argmax())
    if errors_px[worst] > max(WORST_VIEW * most, APART * middle):
        raise ValueError(
            f"camera '{name}': view '{views[worst].name}' is off by {errors_px[worst]:.1f} px where the median view is "
            f"by {middle:.2f}; leave it out (blurred, bent, or of another board)"
        )
    whole = float(np.sqrt((errors_px**2).mean()))
    if whole > most:
        raise ValueError(
            f"camera '{name}': its views leave {whole:.1f} px, allowed: {most:.1f} (1 in 640 of the width); check that "
            "the board is flat, its columns and rows, and that the images are sharp"
        )


def check_moments(
    views: Mapping[str, Sequence[Named]],
    alone_px: Mapping[str, Array],
    together: Mapping[str, Sequence[Array]],
    width_px: int,
) -> None:
    """Raise ValueError where cameras that each see a flat board do not see one board at one moment.

    By camera, ``alone_px`` (v,) is the rms that each view leaves where the camera is by itself, and ``together`` the
    residuals (n, 2) of each view after all cameras were adjusted together.
    """
    by_moment: dict[str, list[float]] = {}
    for name, left in together.items():
        for view, residuals_px in zip(views[name], left, strict=True):
            by_moment.setdefault(view.name, []).append(rms(residuals_px))
    shared = {moment: max(one) for moment, one in by_moment.items() if len(one) > 1}
    whole = float(np.sqrt(np.mean(np.square([*shared.values()]))))
    alone = max(float(np.sqrt((errors_px**2).mean())) for errors_px in alone_px.values())
    if whole > TOGETHER * alone + NOISE * MOST_RMS * width_px:
        worst = max(shared, key=lambda moment: shared[moment])
        raise ValueError(
            f"the cameras {', '.join(views)} leave {whole:.1f} px together where each alone leaves {alone:.2f}: views "
            f"of one name were not taken at one moment (worst: '{worst}', {shared[worst]:.1f} px); hold the board "
            "still, or synchronise the cameras"
        )
