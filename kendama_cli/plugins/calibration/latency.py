"""A camera's delay, from a light whose switching times are known and how bright it is in each image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array

LEAST_SWITCHES = 30
LONGEST_S = 0.5
STEP_S = 0.001
LEAST_EXPLAINED = 0.6
"""Of the brightness's variance, by the light: less is another light, another clock or another film."""
RESAMPLED_N = 400
WIDTHS_S = (0.0005, 0.001, 0.002, 0.004, 0.006, 0.008, 0.012, 0.016, 0.024, 0.033)


@dataclass(frozen=True)
class Blinks:
    """A light that is off before ``switch_s`` (n,), on after the first, off after the second, and so on."""

    switch_s: Array

    def lit_s(self, t_s: Array) -> Array:
        """Return the time for which it was on until ``t_s``, since the first switch; at any shape."""
        until = np.concatenate(
            [[0.0], np.cumsum(np.diff(self.switch_s) * (np.arange(len(self.switch_s) - 1) % 2 == 0))]
        )
        shown = np.append(self.switch_s, self.switch_s[-1] + 1e6)
        until = np.append(until, until[-1] + (1e6 if len(self.switch_s) % 2 else 0.0))
        return np.asarray(np.interp(t_s, shown, until))


@dataclass(frozen=True)
class Delay:
    """Time from the centre of the exposure to the stamp [s]; ``low_s`` to ``high_s`` is its 95 % interval.

    ``width_s`` is over how long an image's stamps and exposure are spread, ``explained`` the share of the brightness's
    variance that the light explains, ``frames`` and ``switches`` how much was used.
    """

    delay_s: float
    low_s: float
    high_s: float
    width_s: float
    explained: float
    frames: int
    switches: int

    @property
    def sigma_s(self) -> float:
        """Standard deviation [s]: the 95 % interval of a normal error is 3.92 of them wide."""
        return (self.high_s - self.low_s) / 3.92


def measure_delay(blinks: Blinks, stamp_s: Array, brightness: Array, *, seed: int = 0) -> Delay:
    """Return the delay D that explains the brightness (n,) of images with the stamps (n,) best.

    An image whose exposure of width W has its middle at s - D is as bright as

        b = dark + (bright - dark) (L(s - D + W/2) - L(s - D - W/2)) / W

    where L is for how long the light has been on. dark and bright come by least squares for each D and W; W also takes
    up what the stamps jitter. The interval is a bootstrap over the stretches between the light's switches, so that
    images of one switch count as one. Raises ValueError, in one line, where the light is not found in the images.
    """
    stamp_s, brightness = np.asarray(stamp_s, dtype=float), np.asarray(brightness, dtype=float)
    shown = (stamp_s > blinks.switch_s[0]) & (stamp_s < blinks.switch_s[-1] + LONGEST_S)
    stamps, levels = stamp_s[shown], brightness[shown]
    within = (blinks.switch_s > stamps.min(initial=np.inf)) & (blinks.switch_s < stamps.max(initial=-np.inf))
    switches = int(within.sum())
    if switches < LEAST_SWITCHES:
        raise ValueError(
            f"the light switches {switches} times while images came; needed: {LEAST_SWITCHES}: film it for longer, and "
            "see that the stamps of both are of one clock"
        )
    coarse = np.arange(0.0, LONGEST_S, STEP_S)
    tried = [(d, w) for w in WIDTHS_S[4:] for d in coarse[:: max(1, int(w / 2 / STEP_S))]]
    start_s, _ = min(tried, key=lambda one: _left(blinks, stamps, levels, *one))
    fine = start_s + np.arange(-0.012, 0.012, 0.0005)
    tried = [(d, w) for w in WIDTHS_S for d in fine]
    delay_s, width_s = min(tried, key=lambda one: _left(blinks, stamps, levels, *one))
    varied = float(levels.var())
    explained = 1.0 - _left(blinks, stamps, levels, delay_s, width_s) / varied if varied > 0 else 0.0
    if explained < LEAST_EXPLAINED:
        raise ValueError(
            f"the light explains {max(explained, 0.0):.0%} of the images' brightness; needed: {LEAST_EXPLAINED:.0%}: "
            "point at the light alone (a region of it), keep other light away, and see that both clocks are one"
        )
    grid = delay_s + np.arange(-0.010, 0.010, 0.00025)
    errors = np.array([_errors(blinks, stamps, levels, d, width_s) for d in grid])
    stretch = np.searchsorted(blinks.switch_s, stamps - delay_s)
    parts = np.zeros((len(grid), int(stretch.max()) + 1))
    for row, error in zip(parts, errors, strict=True):
        np.add.at(row, stretch, error**2)
    parts = parts[:, np.bincount(stretch, minlength=parts.shape[1]) > 0]
    rng = np.random.default_rng(seed)
    drawn = rng.multinomial(parts.shape[1], np.full(parts.shape[1], 1 / parts.shape[1]), RESAMPLED_N)
    found = np.array([_lowest(grid, parts @ weights) for weights in drawn])
    low_s, high_s = np.quantile(found, [0.025, 0.975])
    return Delay(
        _lowest(grid, parts.sum(axis=1)), float(low_s), float(high_s), width_s, explained, len(stamps), switches
    )


def _share(blinks: Blinks, stamp_s: Array, delay_s: float, width_s: float) -> Array:
    middle = stamp_s - delay_s
    return (blinks.lit_s(middle + width_s / 2) - blinks.lit_s(middle - width_s / 2)) / width_s


def _errors(blinks: Blinks, stamp_s: Array, brightness: Array, delay_s: float, width_s: float) -> Array:
    """Return the brightness less that of the line through the fractions of light (n,)."""
    share = _share(blinks, stamp_s, delay_s, width_s)
    away, spread = share - share.mean(), brightness - brightness.mean()
    slope = max(float(away @ spread) / max(float(away @ away), 1e-12), 0.0)  # a light makes nothing darker
    return np.asarray(spread - slope * away)


def _left(blinks: Blinks, stamp_s: Array, brightness: Array, delay_s: float, width_s: float) -> float:
    return float((_errors(blinks, stamp_s, brightness, delay_s, width_s) ** 2).mean())


def _lowest(grid: Array, squares: Array) -> float:
    k = int(np.clip(squares.argmin(), 1, len(grid) - 2))
    before, at, after = squares[k - 1 : k + 2]
    curve = before - 2 * at + after
    return float(grid[k] + (grid[1] - grid[0]) * (np.clip((before - after) / (2 * curve), -1, 1) if curve > 0 else 0.0))
