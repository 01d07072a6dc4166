"""How long cameras with a rolling shutter take to read an image, from the ball's own flights.

What is seen in a lower row was exposed later. As a ball in flight goes through the rows, this delay changes, and what
would be a parabola under gravity is none any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter
from scipy.stats import t as student

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.ball_film import FilmTrack
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.film_positions import OWN_RADIUS_SIGMA, FilmPositions, clock_offsets, from_one, from_several
from kendama_cli.vision.flight_bundle import FlightBundle, Sights
from kendama_cli.vision.flight_search import RecordedTrack, find_flights
from kendama_cli.vision.tracker import sphere_centre

TRIED_S = (0.0, 0.016, 0.032, -0.016, -0.032)
"""Readouts with which flights are looked for: a long one bends a flight out of what is taken for one."""
MORE_FLIGHT = 1.1
"""One of them is believed in where by it the flights are so much longer in all."""
ROUNDS = 2
MOST_FLIGHTS = 40
SURE_S = 0.008
"""With more to either side of an interval a readout is not told: 25 mm at 3 m/s between the first row and the last."""
SMOOTHED = 9
"""Frames over which one camera's radii are smoothed where flights are looked for."""

Spans = list[tuple[float, float]]


@dataclass(frozen=True)
class FoundReadout:
    """The readout of each camera (c,) [s] with half the width of its interval of 95 % (c,), by how much each further
    camera's clock is ahead of the first's (c - 1,) [s], and how many flights tell it."""

    readout_s: Array
    half_s: Array
    offset_s: Array
    flights: int

    @property
    def settings_s(self) -> list[float | None]:
        """What to set each camera's readout to: 0 where a global shutter explains it, None where it cannot be told."""
        return [
            None if half > SURE_S else 0.0 if abs(own) <= half else own
            for own, half in zip(self.readout_s.tolist(), self.half_s.tolist(), strict=True)
        ]


def find_readout(
    tracks: Sequence[FilmTrack], cameras: Sequence[CameraModel], *, same_clock: bool, ball_radius_m: float | None
) -> FoundReadout:
    """The readouts of ``cameras`` from the flights in ``tracks``, whose times are the frames'.

    Offsets between clocks are estimated with them: a delay that all rows have in common is one, and only what changes
    with the row is a readout. So are gravity's direction and the air's drag, which all flights share. One camera needs
    ``ball_radius_m``. Raises ValueError where no flight is seen, or no two films show the ball at one moment.
    """
    films = _Films(tracks, cameras, ball_radius_m if len(tracks) == 1 else None)
    offset_s = np.zeros(len(tracks) - 1) if same_clock else clock_offsets(tracks, cameras)
    readout_s, longest_s = np.zeros(len(cameras)), 0.0
    for trial_s in TRIED_S:
        trial = np.full(len(cameras), trial_s)
        length_s = sum(end_s - begin_s for begin_s, end_s in _spans(films.places(trial, offset_s)))
        if length_s > MORE_FLIGHT * longest_s:
            readout_s, longest_s = trial, length_s
    for _ in range(ROUNDS):
        places = films.places(readout_s, offset_s)
        spans = _spans(places)[:MOST_FLIGHTS]
        if not spans:
            raise ValueError(
                "no free flight is seen: throw the ball up and catch it, across as many lines as there are"
            )
        sights = films.sights(readout_s, offset_s, spans)
        middle_s = np.array([(begin_s + end_s) / 2 for begin_s, end_s in spans])
        curves = np.array([_parabola(places, span, at_s) for span, at_s in zip(spans, middle_s, strict=True)])
        bundle = FlightBundle(cameras, _down(curves), middle_s, same_clock=same_clock, radius_m=films.radius_m)
        made = bundle.adjusted(sights, curves[:, :2].reshape(-1, 6), readout_s, np.array([0.0, *offset_s]))
        readout_s, offset_s = made.readout_s, made.offset_s[1:]
    half_s = made.sigma_s * float(student.ppf(0.975, max(made.freedom, 1)))
    return FoundReadout(readout_s, half_s, offset_s, len(spans))


@dataclass(frozen=True)
class _Films:
    """What was seen; ``radius_m`` is the ball's where its size tells depth."""

    tracks: Sequence[FilmTrack]
    cameras: Sequence[CameraModel]
    radius_m: float | None

    def timed(self, readout_s: Array) -> list[FilmTrack]:
        """Each film with the times of its rows if the cameras read out as ``readout_s`` (c,) says."""
        each = zip(self.tracks, self.cameras, readout_s.tolist(), strict=True)
        return [one.exposed(replace(camera, readout_s=own)) for one, camera, own in each]

    def places(self, readout_s: Array, offset_s: Array) -> FilmPositions:
        """Where the ball is then."""
        timed = self.timed(readout_s)
        if self.radius_m is None:
            return from_several(timed, self.cameras, offset_s)
        if len(timed[0].t_s) < SMOOTHED:
            raise ValueError(f"the film shows the ball in {len(timed[0].t_s)} frames; {SMOOTHED} are the least")
        smooth = savgol_filter(timed[0].radius_px, SMOOTHED, 1)
        return from_one(replace(timed[0], radius_px=smooth), self.cameras[0], self.radius_m)

    def sights(self, readout_s: Array, offset_s: Array, spans: Spans) -> Sights:
        """What is seen within ``spans``; the first and the last may be touched by a hand, and are left out."""
        parts = []
        for k, (timed, camera) in enumerate(zip(self.timed(readout_s), self.cameras, strict=True)):
            at_s = timed.t_s - (offset_s[k - 1] if k else 0.0)
            for flight, (begin_s, end_s) in enumerate(spans):
                inside = np.flatnonzero((at_s > begin_s) & (at_s < end_s) & camera.sees(timed.centre_px))
                parts.append(_sights(self.tracks[k], camera, inside, (k, flight)))
        return Sights(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _spans(places: FilmPositions) -> Spans:
    """From when to when the ball flies."""
    flights = find_flights([RecordedTrack("ball", places.t_s, places.position_m)])
    return [(one.begin_s, one.begin_s + float(one.t_s[-1])) for one in flights]


def _parabola(places: FilmPositions, span: tuple[float, float], about_s: float) -> Array:
    """Place, velocity and half of the acceleration (3, 3) at ``about_s``."""
    within = (places.t_s >= span[0]) & (places.t_s <= span[1])
    powers = (places.t_s[within, None] - about_s) ** np.arange(3)
    return np.asarray(np.linalg.lstsq(powers, places.position_m[within], rcond=None)[0])


def _down(curves: Array) -> Array:
    """The axis (3,) of the world, with its sign, along which most of the falling is."""
    fall = curves[:, 2].sum(axis=0)
    axis = int(np.argmax(np.abs(fall)))
    return np.asarray(np.eye(3)[axis] * np.sign(fall[axis]))


def _sights(track: FilmTrack, camera: CameraModel, inside: NDArray[np.intp], numbers: tuple[int, int]) -> Sights:
    centres, radii = track.centre_px[inside], track.radius_px[inside]
    middles = [sphere_centre(camera, centre, float(radius)) for centre, radius in zip(centres, radii, strict=True)]
    return Sights(
        np.full(len(inside), numbers[0]),
        np.full(len(inside), numbers[1]),
        track.t_s[inside],
        np.array(middles).reshape(-1, 2),
        centres[:, 1],
        radii,
        np.sqrt(np.trace(track.covariance_px2[inside], axis1=1, axis2=2) / 2),
        np.full(len(inside), OWN_RADIUS_SIGMA),
    )
