"""Whether films of several cameras show one ball: by what triangulation leaves over of their sights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.ball_film import FilmTrack
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.film_positions import FEWEST, FilmPositions, clock_offsets, from_several

MEDIAN_CHI_SQUARE = 0.455
"""Of one degree of freedom."""
NEIGHBOURS = 9
"""Moments whose misfit is taken together: a single one has one or few degrees of freedom."""
DOUBTFUL, BETTER = 1.5, 2.0
"""Standard deviations of misfit from which cameras may have been exchanged, if then it is so many times smaller."""
MISSED_RADII, MISSED_SIGMAS = 1.0, 4.0
"""Rays that usually pass each other by more than the ball's radius, and so many standard deviations, are of two balls:
what a calibration is off by is less."""


def agreed_positions(
    tracks: Sequence[FilmTrack], cameras: Sequence[CameraModel], *, same_clock: bool = False
) -> FilmPositions:
    """The places of ``from_several``, whose covariance grows as the films disagree.

    Where what is left over of the sights about a moment is more than its expectation, chi^2 / f > 1, the covariance is
    multiplied by it (Birge 1932). Raises ValueError where films never show the ball at one moment, where two cameras
    that are exchanged agree much better, or where the films do not show one ball.
    """
    made = _placed(tracks, cameras, same_clock=same_clock)
    misfit = _misfit(made)
    if len(tracks) == 2 and misfit > DOUBTFUL and _exchanged_fit(tracks, cameras, same_clock) * BETTER < misfit:
        one, other = (track.name for track in tracks)
        raise ValueError(
            f"the rays miss each other by {misfit:.1f} standard deviations, and much less with the cameras of '{one}' "
            f"and '{other}' exchanged: exchange the films' names, or the calibration's"
        )
    missed = _missed_radii(tracks, made, misfit)
    if misfit > MISSED_SIGMAS and missed > MISSED_RADII:
        raise ValueError(
            f"the films do not show one ball: its rays usually miss each other by {missed:.1f} of its radius; are they "
            "of one throw, and the cameras where they were calibrated?"
        )
    if len(made.t_s) < FEWEST:
        raise ValueError(f"the films show the ball together at {len(made.t_s)} moments; {FEWEST} are the least")
    assert made.chi_square is not None
    scale = np.maximum(_running_mean(made.chi_square), 1.0)
    return replace(made, covariance_m2=made.covariance_m2 * scale[:, None, None])


def _placed(tracks: Sequence[FilmTrack], cameras: Sequence[CameraModel], *, same_clock: bool) -> FilmPositions:
    return from_several(tracks, cameras, np.zeros(len(tracks) - 1) if same_clock else clock_offsets(tracks, cameras))


def _misfit(made: FilmPositions) -> float:
    """What is usually left over, in standard deviations."""
    assert made.chi_square is not None
    return float(np.sqrt(np.median(made.chi_square) / MEDIAN_CHI_SQUARE))


def _exchanged_fit(tracks: Sequence[FilmTrack], cameras: Sequence[CameraModel], same_clock: bool) -> float:
    try:
        return _misfit(_placed(tracks, cameras[::-1], same_clock=same_clock))
    except ValueError:  # so they never show the ball at one moment
        return float("inf")


def _missed_radii(tracks: Sequence[FilmTrack], made: FilmPositions, misfit: float) -> float:
    """The misfit in radii that the ball has in the images: standard deviations of two sights over their radii."""
    sigma_px = np.hypot(*(np.sqrt(np.median(np.trace(one.covariance_px2, axis1=1, axis2=2)) / 2) for one in tracks[:2]))
    radius_px = float(np.mean([np.median(one.radius_px) for one in tracks]))
    return misfit * float(sigma_px) / radius_px


def _running_mean(values: Array) -> Array:
    """Mean of the NEIGHBOURS values about each, fewer at the ends."""
    window = np.ones(min(NEIGHBOURS, len(values)))
    return np.asarray(np.convolve(values, window, "same") / np.convolve(np.ones(len(values)), window, "same"))
