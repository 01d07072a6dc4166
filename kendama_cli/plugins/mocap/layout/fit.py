"""Choosing among readings of a recording: by the checks of every recording, and by a simulated ball on a rope."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kendama_cli.devices.demonstrator.recording import Recording
from kendama_cli.devices.demonstrator.recording_checks import check_samples, check_swing
from kendama_cli.devices.demonstrator.segments import cut_apart
from kendama_cli.devices.demonstrator.settings import PlausibleSettings
from kendama_cli.devices.demonstrator.swing_axes import (
    DIRECTIONS,
    DOUBTFUL_CATCH,
    DOUBTFUL_RISE,
    MAX_S,
    SURE_CATCH,
    SURE_RISE,
    TURNED_RAD,
    UP,
    Rise,
    rise_of,
)
from kendama_cli.devices.demonstrator.tidy import tidied
from kendama_cli.errors import InputError
from kendama_cli.plugins.mocap.layout.reading import AxisMap, Finding, Reading
from kendama_cli.schema.arrays import Array

AS_WELL = 0.7
"""A guess whose ball is caught in so much of the best one's fraction fits as well."""
ENOUGH = 2
"""Rates that make a swing of the same places: the slowest is taken, the next one is told."""
MOST_SWINGS = 12
LONGEST_S = 60.0
"""So many of a session's swings judge its axes, out of so long a part, in which the hand moves most."""


@dataclass(frozen=True)
class Fit:
    """A reading with one direction taken for up: how a ball on a rope moves under it, or why it is no recording."""

    reading: Reading
    up: int
    rise: Rise
    others: tuple[Rise, ...] = ()
    swings: int = 0
    problem: str = ""

    @property
    def is_swing(self) -> bool:
        """Verdict: False where the checks would doubt it."""
        if self.reading.strict:
            return self.rise.rising >= SURE_RISE and self.rise.caught >= SURE_CATCH
        return self.rise.rising > DOUBTFUL_RISE or self.rise.caught > DOUBTFUL_CATCH

    @property
    def order(self) -> tuple[bool, float, float, float]:
        """Qualities, of which the best fit has most."""
        return self.is_swing, -self.reading.rank, self.rise.caught, self.rise.rising

    @property
    def axes(self) -> AxisMap:
        """Our x (the wider horizontal axis), y and z (up) as a right-handed choice of the source's axes."""
        up = DIRECTIONS[self.up]
        z = int(np.abs(up).argmax())
        flat = sorted((i for i in range(3) if i != z), key=lambda i: -float(np.ptp(self.reading.place_m[:, i])))
        x, sign = np.eye(3)[flat[0]], int(up[z])
        y = np.cross(up, x)
        return [(flat[0], 1), (flat[1], int(y[flat[1]])), (z, sign)]

    def path(self) -> Array:
        """Return the places along our axes (n, 3)."""
        return np.column_stack([sign * self.reading.place_m[:, i] for i, sign in self.axes])

    def findings(self) -> list[Finding]:
        """Return what was found of the axes."""
        names, path = self.reading.axes, self.path()
        shown = ["-"[: sign < 0] + names[i] for i, sign in self.axes]
        told = f"a simulated ball on a rope rises over the cup in {self.rise.rising:.0%} of the trials and falls near "
        told += f"it in {self.rise.caught:.0%}"
        if rest := [(one, k) for k, one in enumerate(self.others) if k != self.up]:
            second, k = max(rest, key=lambda one: (one[0].caught, one[0].rising))
            told += f" (next best, {_axis_name(names, k)} up: {second.rising:.0%} and {second.caught:.0%})"
        extent = np.ptp(path, axis=0)
        flat = path[:, :2] - path[:, :2].mean(axis=0)
        along = np.linalg.eigh(flat.T @ flat)[1][:, 1]
        heading = math.atan2(abs(float(along[1])), abs(float(along[0])))
        turned = (
            f"; the plane is turned by {math.degrees(heading):.0f} deg from {shown[0]}, and so will the arm's be"
            if heading > TURNED_RAD
            else ""
        )
        wide = (
            f"{extent[0]:.2f} m along {shown[0]}, {extent[1]:.2f} m along {shown[1].lstrip('-')}, {extent[2]:.2f} m up"
        )
        return [
            Finding("up", shown[2], told),
            Finding("swing plane", f"{shown[0]} and {shown[2]}", wide + turned),
            Finding("mirror", "not known", "positions alone cannot tell it, and a mirrored swing is a swing"),
        ]


def fits(path: str, readings: Sequence[Reading], plausible: PlausibleSettings) -> list[Fit]:
    """Return the fits of all readings, the best first."""
    found: list[Fit] = []
    swings: Counter[str] = Counter()
    for reading in readings:
        family = f"{reading.track} {reading.guessed.rpartition(' Hz')[0].rpartition(' ')[0]}"
        if reading.strict and swings[family] >= ENOUGH:  # faster rates follow slower ones
            continue
        new = _fitted(path, reading, plausible)
        swings[family] += any(fit.is_swing for fit in new)
        found += new
    return sorted(found, key=lambda fit: fit.order, reverse=True)


def equals(ordered: Sequence[Fit]) -> list[Fit]:
    """Return the fits that are as good as the first: of another body, unit, rate or up."""
    best = ordered[0]
    return [
        fit
        for fit in ordered[1:]
        if fit.is_swing
        and int(fit.reading.rank) == int(best.reading.rank)
        and fit.rise.caught >= AS_WELL * best.rise.caught
        and (fit.reading.track, fit.reading.guessed, fit.up) != (best.reading.track, best.reading.guessed, best.up)
    ]


def _fitted(path: str, reading: Reading, plausible: PlausibleSettings) -> list[Fit]:
    """Return a fit for each direction that may be up; one with the problem where the checks refuse the reading."""
    whole = Recording(path, reading.track, reading.t_s, reading.place_m, str, "", "")
    try:
        whole = tidied(whole, "even")
        check_samples(whole, math.inf)
        swings = cut_apart(liveliest(whole))[0][:MOST_SWINGS]
        for swing in swings:
            check_swing(swing, replace(plausible, axes="off"))
    except InputError as wrong:
        return [Fit(reading, 0, Rise(0.0, 0.0), problem=wrong.problem)]
    judged = [one for one in swings if one.t_s[-1] - one.t_s[0] <= MAX_S] or swings[:1]
    each = [rise_of(one.t_s, one.position_m, DIRECTIONS) for one in judged]
    rises = tuple(
        Rise(float(np.mean([one[k].rising for one in each])), float(np.mean([one[k].caught for one in each])))
        for k in range(len(UP))
    )
    return [Fit(reading, k, rise, rises, len(swings)) for k, rise in enumerate(rises)]


def liveliest(whole: Recording) -> Recording:
    """Return the LONGEST_S of ``whole`` in which the hand goes farthest; itself if it is shorter."""
    t_s = whole.t_s
    after = np.searchsorted(t_s, t_s + LONGEST_S)
    if after[0] == len(t_s):
        return whole
    gone_m = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(whole.position_m, axis=0), axis=1))))
    first = int(np.argmax(gone_m[after - 1] - gone_m))
    part = whole.rows(np.arange(first, after[first]))
    return replace(part, t_s=part.t_s - part.t_s[0])


def _axis_name(names: Sequence[str], direction: int) -> str:
    axis = int(np.abs(DIRECTIONS[direction]).argmax())
    return "-"[: int(DIRECTIONS[direction][axis] < 0)] + names[axis]
