"""The laws of a detector notice one that breaks them; that ours keeps them is run by the plugin."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.plugins.suites.detector import CHECKS
from kendama_cli.vision.detection.colour_detector import ColourDetector
from tests.vision.scenes import predict


def _check_all(subject):
    for check in CHECKS:
        check(subject)


class _Wrong:
    """The shipped detector with one fault."""

    def __init__(self, fault):
        self._right, self._fault, self._seen = ColourDetector(predict().detector), fault, 0

    def candidates(self, pixels, origin_px=(0, 0), hint=None):
        fault = self._fault
        self._seen += 1
        found = list(self._right.candidates(pixels, (0, 0) if fault == "origin" else origin_px, hint))
        if fault == "blind":
            return
        if fault == "guesses" and not found:
            found = list(self._right.candidates(np.roll(pixels, 0), origin_px)) or [self._guess()]
        if fault == "hint":
            found = list(self._right.candidates(pixels, origin_px, None))
        for one in found:
            change = {
                "size": {"radius_px": 2 * one.radius_px},
                "score": {"score": 7.0},
                "covariance": {"covariance_px2": -one.covariance_px2},
                "memory": {"centre_px": one.centre_px + 0.01 * self._seen},
            }.get(fault, {})
            yield dataclasses.replace(one, **change)

    def _guess(self):
        from kendama_cli.vision.detection.interface import Sighting  # noqa: PLC0415

        return Sighting(np.array([80.0, 60.0]), np.eye(2), 14.0, 0.9)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("blind", "a clear ball is found"),
        ("size", "radius is about right"),
        ("score", "score lies in"),
        ("covariance", "positive definite"),
        ("guesses", "where there is none"),
        ("origin", "origin_px counts"),
        ("hint", "near the hint comes first"),
        ("memory", "nothing is remembered"),
    ],
)
def test_the_laws_notice_a_detector_that_breaks_them(fault, words):
    with pytest.raises(AssertionError, match=words):
        _check_all(_Wrong(fault))
