"""The laws of a demonstrator, for every variant or a project's own (run: see kendama_cli/conformance.py).

Each check takes a function that opens the demonstrators, and raises AssertionError, with the law in words, where one of
them breaks it. ``CHECKS`` lists them all. Every demonstrator is recorded anew for each law.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.devices.demonstrator.interface import Demonstrator, open_demonstrators
from kendama_cli.motion.sampling import step_s
from kendama_cli.plugins.suites.law import must

OpenDemonstrators = Callable[[], Sequence[Demonstrator]]

RATE_FRACTION = 0.05
"""Ratio by which the median rate of the samples may differ from the one that a live device states."""


def check_names(opened: OpenDemonstrators) -> None:
    """Check that there is at least one demonstrator, each with a name of its own, which names its demonstration."""
    hands = opened()
    names = [hand.name for hand in hands]
    _close(hands)
    must(len(hands) > 0, "there is at least one demonstrator")
    must(all(names) and len(set(names)) == len(names), f"every demonstrator has a name of its own (are {names})")


def check_time(opened: OpenDemonstrators) -> None:
    """Check that samples begin at time 0 and rise, at about the rate that the demonstrator states."""
    for hand in opened():
        t_s = np.array([sample.t_s for sample in hand.samples()])
        hand.close()
        must(len(t_s) >= 2, f"demonstrator '{hand.name}' has two samples or more")
        must(t_s[0] == 0, f"the first sample of '{hand.name}' is at time 0")
        must(bool((np.diff(t_s) > 0).all()), f"the times of '{hand.name}' rise")
        rate_hz = 1 / step_s(t_s)
        must(abs(rate_hz / hand.rate_hz - 1) < RATE_FRACTION, f"'{hand.name}' comes at its rate (is {rate_hz:.1f} Hz)")


def check_poses(opened: OpenDemonstrators) -> None:
    """Check that positions are finite, in metres, rotations unit quaternions, and most of the swing is tracked."""
    for hand in opened():
        samples = list(hand.samples())
        hand.close()
        positions = np.array([sample.position_m for sample in samples])
        rotations = np.array([sample.rotation_wxyz for sample in samples])
        must(bool(np.isfinite(positions).all()), f"the positions of '{hand.name}' are finite")
        must(
            bool(np.abs(positions - positions[0]).max() < 10.0),
            f"'{hand.name}' moves by less than 10 m: metres are meant",
        )
        must(bool(np.allclose(np.linalg.norm(rotations, axis=1), 1.0, atol=1e-6)), "rotations are unit quaternions")
        must(2 * sum(sample.tracked for sample in samples) > len(samples), f"most samples of '{hand.name}' are tracked")


def check_close(opened: OpenDemonstrators) -> None:
    """Check that a force may be rendered to any demonstrator, and that closing twice is as good as once."""
    hands = opened()
    for hand in hands:
        hand.render_force(np.array([0.0, 0.0, -0.1]))
    _close(hands)
    _close(hands)


CHECKS = (check_names, check_time, check_poses, check_close)


def subject(configuration: Mapping[str, Any], folder: Path) -> OpenDemonstrators:
    """Open the demonstrators of ``capture``; what a live one records for the laws goes to ``folder``."""
    capture = configuration["capture"]
    if not hasattr(capture, "record"):
        return lambda: open_demonstrators(capture)
    # a recording is never overwritten, and every law records anew
    files = (folder / f"{number}-{Path(capture.record).name}" for number in itertools.count())
    return lambda: open_demonstrators(dataclasses.replace(capture, record=str(next(files))))


def test_the_hands_keep_the_law(
    law: Callable[[OpenDemonstrators], None], configuration: Mapping[str, Any], tmp_path: Path
) -> None:
    """Run by kendama_cli/conformance.py for every law."""
    law(subject(configuration, tmp_path))


def _close(hands: Sequence[Demonstrator]) -> None:
    for hand in hands:
        hand.close()
