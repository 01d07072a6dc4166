"""Comparison of detections in images with the boxes that somebody drew in them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.plugins.films.ball_box import BallBox
from kendama_cli.plugins.films.boxes import read_boxes
from kendama_cli.plugins.shared.videos.video import read_image
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.interface import Sighting


@dataclass(frozen=True)
class Comparison:
    """Detections against boxes: a hit has its centre in a box.

    The last four are the highest recall of all thresholds that have this precision, and that threshold; None if none
    has it.
    """

    boxes: int
    sightings: int
    hits: int
    recall: float | None
    precision: float | None
    error_radii_p50: float | None
    recall_at_precision_90: float | None
    threshold_at_precision_90: float | None
    recall_at_precision_99: float | None
    threshold_at_precision_99: float | None


def compare(candidates: Mapping[Path, Sequence[Sighting]], labels: Path, threshold: float) -> Comparison:
    """Compare the candidates of each image, best first, with the boxes in ``labels``.

    ``labels`` is a folder as of ``labelled`` or of text files alone; a candidate of ``threshold`` or more is a
    detection.
    """
    boxes, rows = 0, []
    for file, shown in scored_boxes(list(candidates), labels):
        boxes += len(shown)
        scores = [one.score for one in candidates[file]]
        rows += list(zip(scores, _errors(candidates[file], shown), strict=True))
    score, error = np.array(rows, dtype=np.float64).reshape(-1, 2).T
    seen, hit = score >= threshold, np.isfinite(error)
    sightings, hits = int(seen.sum()), int((seen & hit).sum())
    return Comparison(
        boxes,
        sightings,
        hits,
        hits / boxes if boxes else None,
        hits / sightings if sightings else None,
        float(np.median(error[seen & hit])) if hits else None,
        *_at_precision(score, hit, boxes, 0.9),
        *_at_precision(score, hit, boxes, 0.99),
    )


def _errors(candidates: Sequence[Sighting], boxes: Sequence[BallBox]) -> list[float]:
    """Return each candidate's distance to the centre of its box [radii], infinite if no box is left for it."""
    left, errors = list(boxes), []
    for one in candidates:
        off = [np.abs(one.centre_px - (box.u_px, box.v_px)) for box in left]
        inside = [
            i
            for i, (box, (u, v)) in enumerate(zip(left, off, strict=True))
            if u <= box.width_px / 2 and v <= box.height_px / 2
        ]
        errors.append(float(np.hypot(*off[inside[0]])) / left.pop(inside[0]).radius_px if inside else np.inf)
    return errors


def _at_precision(score: Array, hit: Array, boxes: int, least: float) -> tuple[float | None, float | None]:
    """Return the highest recall at a precision of ``least`` or more, and the lowest score that then is a detection."""
    order = np.argsort(-score, kind="stable")
    hits = np.cumsum(hit[order])
    whole = np.append(np.diff(score[order]) != 0, True)[: len(order)]  # equal scores are detections together
    good = np.flatnonzero(whole & (hits / np.arange(1, len(order) + 1) >= least) & (hits > 0))
    if not (boxes and len(good)):
        return None, None
    return float(hits[good[-1]]) / boxes, float(score[order[good[-1]]])


def scored_boxes(images: Sequence[Path], labels: Path) -> Iterator[tuple[Path, Sequence[BallBox]]]:
    """Yield each image that has a file of boxes in ``labels``, with them; raises InputError if none has."""
    files = {path.stem: path for path in sorted(labels.rglob("*.txt"))} if labels.is_dir() else {}
    if not files:
        raise InputError(str(labels), "it holds no file of boxes", remedy="give the folder labels/ of the images")
    known = [image for image in images if image.stem in files]
    if not known:
        raise InputError(
            str(labels), "no file of boxes in it has an image's name", remedy="give labels of these images"
        )
    for image in known:
        pixels = read_image(image)
        yield image, read_boxes(files[image.stem], pixels.shape[1], pixels.shape[0])
