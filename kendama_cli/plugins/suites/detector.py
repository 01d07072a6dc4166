"""The laws of a detector, for every variant or a project's own (run: see kendama_cli/conformance.py).

Each check takes a detector and raises AssertionError, with the law in words, where it breaks it. ``CHECKS`` lists them
all. The images are of red discs on grey, a ball as the shipped one: a detector of other balls is set to red for this.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from kendama_cli.plugins.suites.law import must
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.interface import Detector, Image, SearchHint, Sighting, make_detector

BALL_BGR, SURROUNDINGS_BGR = (25.0, 30.0, 190.0), (110.0, 112.0, 108.0)
RADIUS_PX = 14.0
NEAR_PX = 1.0
"""So near to the disc's centre a sighting must be: a tenth of what the tracker's gate lets pass."""


def disc_image(*centres_px: tuple[float, float], width: int = 160, height: int = 120) -> Image:
    """Red discs with a soft rim on grey noise, (height, width, 3) blue, green, red; the same for the same positions."""
    rows, columns = np.mgrid[:height, :width].astype(np.float64)
    fraction = np.zeros((height, width))
    for u, v in centres_px:
        fraction = np.maximum(fraction, np.clip(RADIUS_PX + 0.5 - np.hypot(columns - u, rows - v), 0.0, 1.0))
    clean = fraction[..., None] * np.array(BALL_BGR) + (1 - fraction[..., None]) * np.array(SURROUNDINGS_BGR)
    noisy = clean + np.random.default_rng(7).normal(0.0, 2.0, clean.shape)
    image: Image = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
    return image


def check_finds(detector: Detector) -> None:
    """Check that the ball is found at its position, with its size and a covariance that a filter can use."""
    found = _first(detector, disc_image((70.3, 52.6)))
    must(found is not None, "a clear ball is found")
    assert found is not None
    must(
        float(np.hypot(*(found.centre_px - (70.3, 52.6)))) < NEAR_PX, f"it is found where it is (at {found.centre_px})"
    )
    must(abs(found.radius_px / RADIUS_PX - 1) < 0.15, f"its radius is about right (is {found.radius_px:.1f} px)")
    must(0.0 <= found.score <= 1.0, f"the score lies in 0..1 (is {found.score})")
    covariance = found.covariance_px2
    must(
        covariance.shape == (2, 2) and bool(np.allclose(covariance, covariance.T)), "the covariance is symmetric (2, 2)"
    )
    must(bool((np.linalg.eigvalsh(covariance) > 0).all()), "the covariance is positive definite")


def check_not_seen(detector: Detector) -> None:
    """Check that an image without a ball gives no confident candidate."""
    scores = [one.score for one in detector.candidates(disc_image())]
    must(all(score < 0.5 for score in scores), f"no ball is seen with confidence where there is none (scores {scores})")


def check_origin(detector: Detector) -> None:
    """Check that a part of an image gives the whole image's coordinates."""
    image = disc_image((70.3, 52.6))
    part = _first(detector, np.ascontiguousarray(image[20:100, 30:120]), (30, 20))
    must(part is not None, "a ball is found in a part of the image")
    assert part is not None
    must(float(np.hypot(*(part.centre_px - (70.3, 52.6)))) < NEAR_PX, f"origin_px counts (found at {part.centre_px})")


def check_hint(detector: Detector) -> None:
    """Check that of two balls the expected one comes first."""
    image = disc_image((40.0, 60.0), (115.0, 60.0))
    for u in (40.0, 115.0):
        found = _first(detector, image, hint=SearchHint(np.array([u + 3.0, 58.0]), RADIUS_PX))
        must(
            found is not None and abs(float(found.centre_px[0]) - u) < NEAR_PX,
            f"the ball near the hint comes first ({u})",
        )


def check_repeats(detector: Detector) -> None:
    """Check that an image gives the same candidates whenever it is shown, whatever came between, and stays as it is."""
    image = disc_image((70.3, 52.6))
    before = image.copy()
    first = _values(detector, image)
    _values(detector, disc_image((30.0, 90.0)))
    must(bool(np.array_equal(first, _values(detector, image))), "nothing is remembered from image to image")
    must(bool(np.array_equal(image, before)), "the image is not changed")


CHECKS = (check_finds, check_not_seen, check_origin, check_hint, check_repeats)


def subject(configuration: Mapping[str, Any]) -> Detector:
    """Return the detector of ``predict.detector``."""
    return make_detector(configuration["predict"].detector)


def test_the_detector_keeps_the_law(law: Callable[[Detector], None], configuration: Mapping[str, Any]) -> None:
    """Run by kendama_cli/conformance.py for every law."""
    law(subject(configuration))


def _first(
    detector: Detector, image: Image, origin_px: tuple[int, int] = (0, 0), hint: SearchHint | None = None
) -> Sighting | None:
    return next(iter(detector.candidates(image, origin_px, hint)), None)


def _values(detector: Detector, image: Image) -> Array:
    found = [
        np.array([*one.centre_px, *one.covariance_px2.ravel(), one.radius_px, one.score])
        for one in detector.candidates(image)
    ]
    return np.array(found)
