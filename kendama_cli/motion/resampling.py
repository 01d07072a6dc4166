"""From recorded samples to what the regression reads: the moving part, aligned with the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.motion.onset import Moving
from kendama_cli.schema.arrays import Array

MIN_SAMPLES = 5

LONGEST_GAP = 0.1
"""Share of the motion that may be missing in one piece: two basis functions of twenty still see its ends."""


@dataclass(frozen=True)
class TrimmedDemonstration:
    """The samples of one demonstration's motion.

    ``position_m`` (n, k) is relative to the first sample; ``uneven_share`` (n,) is s = t / T from 0 to 1, None where
    the samples come at equal steps. ``onset_s`` is where it begins in the recording's own time.
    ``starts_still`` and ``ends_still`` say that it certainly rests there, ``starts_fast`` and ``ends_fast`` that it
    certainly moves; between, the fit must decide.
    """

    position_m: Array
    uneven_share: Array | None
    duration_s: float
    onset_s: float
    starts_still: bool
    ends_still: bool
    starts_fast: bool
    ends_fast: bool

    @property
    def even(self) -> bool:
        """Whether the samples come at equal steps."""
        return self.uneven_share is None

    @property
    def share(self) -> Array:
        """s (n,) of every sample."""
        return np.linspace(0.0, 1.0, len(self.position_m)) if self.uneven_share is None else self.uneven_share


def cut(t_s: Array, position_m: Array, moving: Moving, head: float | None, tail: float | None) -> TrimmedDemonstration:
    """The moving part with ``head`` and ``tail`` of its duration before and after it; None keeps all samples.

    Raises ValueError where fewer than 5 samples are left, and naming the sample before a gap that is too long.
    """
    onset_s, end_s = t_s[moving.first], t_s[moving.last]
    slack = 1e-9 * (end_s - onset_s)
    first = 0 if head is None else int(np.searchsorted(t_s, onset_s - head * (end_s - onset_s) - slack))
    last = len(t_s) if tail is None else int(np.searchsorted(t_s, end_s + tail * (end_s - onset_s) + slack))
    t, p = t_s[first:last], position_m[first:last]
    if len(t) < MIN_SAMPLES:
        raise ValueError(f"only {len(t)} samples move; a swing needs at least {MIN_SAMPLES}")
    duration = float(t[-1] - t[0])
    if not moving.even:
        steps = np.diff(t)
        longest = int(steps.argmax())
        # few samples are a low rate, not a gap
        if steps[longest] > max(LONGEST_GAP * duration, 2 * duration / len(t)):
            raise ValueError(
                f"after sample {first + longest + 1} nothing is known for {steps[longest]:.3g} s of a motion of "
                f"{duration:.3g} s; allowed: {LONGEST_GAP:.0%} of it; fill the gap or record the swing again"
            )
    return TrimmedDemonstration(
        position_m=p - p[0],
        uneven_share=None if moving.even else (t - t[0]) / duration,
        duration_s=duration,
        onset_s=float(t[0]),
        starts_still=moving.still_at(first),
        ends_still=moving.still_at(last - 1),
        starts_fast=bool(moving.speed_m_s[first] > moving.rest_m_s),
        ends_fast=bool(moving.speed_m_s[last - 1] > moving.rest_m_s),
    )


def common_margins(t_s: Sequence[Array], moving: Sequence[Moving], wanted: float) -> tuple[float, float]:
    """The shares of rest that all demonstrations have before and after their motion, at most ``wanted`` each.

    The same share for all: so their motions begin and end at the same shares and can be averaged.
    """
    heads, tails = [wanted], [wanted]
    for t, one in zip(t_s, moving, strict=True):
        length = t[one.last] - t[one.first]
        heads.append((t[one.first] - t[0]) / length)
        tails.append((t[-1] - t[one.last]) / length)
    return min(heads), min(tails)
