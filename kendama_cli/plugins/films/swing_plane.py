"""Scale and vertical of a swing that one camera saw from the side, by what string and gravity do to the ball."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array

GRAVITY_M_S2 = 9.81
TAUT_WIDTH = 0.03
"""A string counts as taut where it shows within this part of its usual length."""
FEWEST_TAUT, FEWEST_RESTING = 5, 5
SHORTEST_RADII = 6.0
"""A taut string is longer than so many of the ball's radii: 0.3 m of string and a ball of 60 mm come to 10."""
SLACK = 0.88
"""The ball flies where it is nearer than this part of the taut string (a tenth of it may lie round the cup), and
farther from the cup than their sizes."""
REST_SPEED = 0.1
"""Ball and cup rest below so many lengths of the string per second."""
SHORTEST_FLIGHT_S = 0.15
FLIGHT_MISFIT_RADII = 0.25
DRAG = 0.01
"""Drag and perspective are left out: of a ball of 50 g at 2 m/s the former is 0.003 of gravity."""
STEEPEST = 0.5
"""The cosine between a flight's acceleration and the vertical is at least this."""
PICTURE_DOWN = np.array([0.0, 1.0])
AGREE, AGREE_SIGMAS = 0.03, 3.0
"""String and gravity agree within this part and so many standard deviations of the flight's."""
REFUSED = 0.4
"""No string is measured so wrong: the times are."""


@dataclass(frozen=True)
class SwingSight:
    """Ball and cup where a film shows both (n,): times [s], places (n, 2) [px], and their usual radii [px]."""

    t_s: Array
    cup_px: Array
    ball_px: Array
    cup_radius_px: float
    ball_radius_px: float


@dataclass(frozen=True)
class SwingPlane:
    """The swing's plane in the image: unit vertical ``down`` (2,), pixels per metre, and sentences on their sources."""

    down: Array
    px_per_m: float
    notes: tuple[str, ...]


@dataclass(frozen=True)
class FlightGravity:
    """Acceleration (2,) [px/s^2] of the ball in free flight, its standard deviation, and how long it flies [s]."""

    acceleration_px: Array
    sigma_px: float
    flown_s: float

    @property
    def px_s2(self) -> float:
        """Size of the acceleration [px/s^2]."""
        return float(np.linalg.norm(self.acceleration_px))


def swing_plane(sight: SwingSight, string_m: float | None, tie_m: float) -> SwingPlane:
    """Return the plane by the hanging ball, the string, and gravity in free flight, as far as each is seen.

    Raises ValueError where neither string nor flight tells the scale, or where they contradict each other.
    """
    rest = hanging(sight)
    flight = flight_gravity(sight, PICTURE_DOWN if rest is None else rest[0])
    if rest is not None:
        down, source = rest[0], f"the ball at rest ({rest[1]} images)"
    elif flight is not None:
        down, source = flight.acceleration_px / flight.px_s2, "the ball's flight"
    else:
        down, source = PICTURE_DOWN, "the picture's edge, for the ball neither rests nor flies"
    lean_deg = math.degrees(math.atan2(-down[0], down[1]))
    vertical = f"vertical: {source}, {lean_deg:+.1f} deg from the picture's"
    by_gravity = "" if flight is None else f"gravity in {flight.flown_s:.1f} s of free flight"
    if string_m is None:
        if flight is None:
            raise ValueError(f"the ball never flies for {SHORTEST_FLIGHT_S:g} s, so gravity does not tell the scale")
        px_per_m = flight.px_s2 / GRAVITY_M_S2
        part = max(flight.sigma_px / flight.px_s2, DRAG)
        told = f"1 px is {1e3 / px_per_m:.2f} mm (+-{part:.0%}) by {by_gravity}; {vertical}"
        return SwingPlane(down, px_per_m, (told,))
    taut = string_scale(sight, down, string_m, tie_m)
    if taut is None:
        raise ValueError(f"the string is never taut: fewer than {FEWEST_TAUT} images show it equally long")
    px_per_m, images = taut
    notes = [f"1 px is {1e3 / px_per_m:.2f} mm by the string, taut in {images} images; {vertical}"]
    if flight is not None:
        notes += _compared(flight, px_per_m, by_gravity)
    return SwingPlane(down, px_per_m, tuple(notes))


def _compared(flight: FlightGravity, px_per_m: float, by_gravity: str) -> list[str]:
    """Return a sentence where gravity tells another scale than the string; raises ValueError where it is far off."""
    off, part = flight.px_s2 / GRAVITY_M_S2 / px_per_m - 1, flight.sigma_px / flight.px_s2
    if abs(off) < AGREE + AGREE_SIGMAS * part:
        return []
    told = f"{by_gravity} is {1 + off:.2f} of what the string's length says"
    if abs(off) > REFUSED:
        raise ValueError(
            f"{told}: the video's times are {1 / math.sqrt(1 + off):.2g} times as long as the swing's, or the string "
            "is not so long"
        )
    return [f"{told}: measure the string from where it leaves the cup to the ball's middle, and tie_m"]


def string_scale(sight: SwingSight, down: Array, string_m: float, tie_m: float) -> tuple[float, int] | None:
    """Return the pixels per metre by the taut string and in how many images it is taut; None if it never is.

    The string of length l is tied at a height h under the cup's place c. In pixels per metre q and with the vertical d
    the ball is at |b - c - h q d| = l q where the string is taut, which gives q of every image, and at less where it is
    slack: the fullest interval of q of TAUT_WIDTH is the taut one.
    """
    across = sight.ball_px - sight.cup_px
    along, a = tie_m * across @ down, string_m**2 - tie_m**2
    scales = np.sort((np.sqrt(along**2 + a * (across**2).sum(axis=1)) - along) / a)
    scales = scales[scales * string_m > SHORTEST_RADII * sight.ball_radius_px]
    if not len(scales):
        return None
    counts = np.searchsorted(scales, scales * (1 + TAUT_WIDTH), side="right") - np.arange(len(scales))
    first = int(counts.argmax())
    if counts[first] < FEWEST_TAUT:
        return None
    return float(np.median(scales[first : first + counts[first]])), int(counts[first])


def hanging(sight: SwingSight) -> tuple[Array, int] | None:
    """Return the direction (2,) in which the ball hangs at rest, and in how many images; None if it never does."""
    across = sight.ball_px - sight.cup_px
    length = np.linalg.norm(across, axis=1)
    longest = float(np.quantile(length, 0.95))
    if len(length) < FEWEST_RESTING or longest < SHORTEST_RADII * sight.ball_radius_px:
        return None
    speeds = [np.linalg.norm(_speed(sight.t_s, one), axis=1) for one in (sight.cup_px, sight.ball_px)]
    rests = (np.max(speeds, axis=0) < REST_SPEED * longest) & (length > SLACK * longest)
    if rests.sum() < FEWEST_RESTING:
        return None
    mean = np.median(across[rests] / length[rests, None], axis=0)
    return mean / np.linalg.norm(mean), int(rests.sum())


def _speed(t_s: Array, place_px: Array) -> Array:
    """Return velocities (n, 2) over 0.1 s or more about each image, with the noise of one image taken out."""
    first, last = (np.searchsorted(t_s, t_s + off).clip(0, len(t_s) - 1) for off in (-0.05, 0.05))
    apart = np.maximum(t_s[last] - t_s[first], 1e-6)
    return np.asarray((place_px[last] - place_px[first]) / apart[:, None])


def flight_gravity(sight: SwingSight, down: Array) -> FlightGravity | None:
    """Return the acceleration of the ball while the string is slack; None if it does not fly.

    Each flight is the parabola of least squares; flights count by their certainty.
    """
    length = np.linalg.norm(sight.ball_px - sight.cup_px, axis=1)
    near = 1.5 * (sight.cup_radius_px + sight.ball_radius_px)
    flies = (length < SLACK * np.quantile(length, 0.95)) & (length > near)
    weight, total, flown_s = 0.0, np.zeros(2), 0.0
    for first, last in _runs(sight.t_s, flies):
        fit = _parabola(sight.t_s[first:last], sight.ball_px[first:last])
        if fit is None:
            continue
        acceleration, sigma, misfit = fit
        straight = acceleration @ down > STEEPEST * np.linalg.norm(acceleration)
        if misfit < FLIGHT_MISFIT_RADII * sight.ball_radius_px and straight:
            weight += sigma**-2
            total += acceleration * sigma**-2
            flown_s += float(sight.t_s[last - 1] - sight.t_s[first])
    return FlightGravity(total / weight, weight**-0.5, flown_s) if weight else None


def _runs(t_s: Array, flies: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first and last + 1 of stretches of ``flies`` that last SHORTEST_FLIGHT_S, less an image on either side."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flies, [False]]).astype(int)))
    runs = zip(edges[::2] + 1, edges[1::2] - 1, strict=True)
    return [(a, b) for a, b in runs if b - a >= 5 and t_s[b - 1] - t_s[a] >= SHORTEST_FLIGHT_S]


def _parabola(t_s: Array, place_px: Array) -> tuple[Array, float, float] | None:
    """Return the acceleration (2,), its standard deviation and the rms misfit [px] of a parabola of least squares."""
    t = t_s - t_s.mean()
    powers = np.column_stack([np.ones_like(t), t, t**2 / 2])
    found, _, rank, _ = np.linalg.lstsq(powers, place_px, rcond=None)
    if rank < 3:
        return None
    misfit = float(np.sqrt(((place_px - powers @ found) ** 2).sum() / (2 * (len(t) - 3))))
    variance = np.linalg.inv(powers.T @ powers)[2, 2]
    return found[2], max(misfit, 0.2) * float(np.sqrt(variance)), misfit
