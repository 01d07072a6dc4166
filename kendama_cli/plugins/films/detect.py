"""Teaching a ball, and finding it in images: the work of ``camera train`` and ``camera detect``."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from kendama_cli.cli import render
from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site
from kendama_cli.errors import InputError, UsageError
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.plugins.films.ball_box import FEWEST_BOXES, BallBox, TrainedImage
from kendama_cli.plugins.films.boxes import image_files, labelled, read_boxes, read_labelled
from kendama_cli.plugins.films.settings import TrainedDetectorSettings
from kendama_cli.plugins.films.trained_detector import TrainedDetector
from kendama_cli.plugins.films.training import TrainedBall, teach
from kendama_cli.plugins.shared.videos.video import read_image
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.interface import Detector, Sighting, make_detector
from kendama_cli.vision.settings import DetectorSettings


@dataclass(frozen=True)
class SeeingOptions:
    """Options of a detector: its name and overrides of its settings, or a folder of images with boxes to train it.

    Also the maximum number of balls an image shows.
    """

    site: Site
    detector: str | None
    teach: Path | None
    seed: int
    overrides: tuple[str, ...] = ()
    balls: int = 1


@dataclass(frozen=True)
class Seeing:
    """A detector, the score from which its sightings count, and the images whose boxes taught it."""

    detector: Detector
    threshold: float
    taught: Sequence[TrainedImage] = ()


def train_ball(folder: Path, output: Path, seed: int) -> None:
    """Learn the ball from a folder of images with boxes, and write it."""
    refuse_output(output, "a trained ball is a NumPy archive", ".npz")
    ball = trained(folder, [read_labelled(one) for one in labelled(folder)], seed)
    write_output(output, ball.to_bytes())
    render.text(f"{output}; use it with predict/detector=trained predict.detector.ball={output}")


def trained(source: Path, images: Sequence[TrainedImage], seed: int) -> TrainedBall:
    """Train on ``images``; raises InputError, naming ``source``, if they train no detector."""
    boxes = sum(len(image.boxes) for image in images)
    if 0 < boxes < FEWEST_BOXES:
        number = "1 box teaches" if boxes == 1 else f"{boxes} boxes teach"
        render.note(f"{number} the ball: with 3 to 10 it is found more often, and a wrong one is noticed")
    try:
        return teach(images, seed)
    except ValueError as wrong:
        raise InputError(str(source), str(wrong), remedy="draw each box close about the ball") from None


def detector_name(options: SeeingOptions, *, boxes: bool) -> str:
    """Return the name of the detector that is asked for; ``boxes``: some are given beside ``options.teach``.

    Raises UsageError where neither boxes nor a name are given, or both.
    """
    if options.teach is None and not boxes:
        if options.detector is None:
            raise UsageError(
                "nobody has shown the ball: draw boxes about it by 'kendama camera train FILM' and add --train FOLDER "
                "('track' takes --box FRAME:X,Y,W,H too, 3 to 10 of them), or name a detector, as --detector colour"
            )
        return options.detector
    if options.detector not in (None, "trained"):
        raise UsageError(f"--detector {options.detector}: boxes teach the detector 'trained'; leave out one of the two")
    return "trained"


def open_seeing(options: SeeingOptions, shown: Sequence[TrainedImage] = (), *, without: Path | None = None) -> Seeing:
    """Open the detector of the options; ``shown`` are images with boxes beside those of ``options.teach``.

    The image ``without`` is left out of the training.

    Raises UsageError where name and boxes contradict each other, InputError where they teach nothing.
    """
    name = detector_name(options, boxes=bool(shown))
    by_boxes = options.teach is not None or bool(shown)
    predict = build_settings(composed(options.site, [f"predict/detector={name}", *options.overrides]))["predict"]
    settings: DetectorSettings = predict.detector
    if isinstance(settings, TrainedDetectorSettings):
        settings = dataclasses.replace(settings, balls=max(settings.balls, options.balls))
    if isinstance(settings, TrainedDetectorSettings) and by_boxes:
        images = list(shown)
        if options.teach is not None:
            images += [read_labelled(one) for one in labelled(options.teach) if one.image.resolve() != without]
        ball = trained(options.teach or Path("--box"), images, options.seed)
        return Seeing(TrainedDetector(settings, ball), settings.score_min, images)
    threshold = settings.score_min if isinstance(settings, TrainedDetectorSettings) else 0.5
    return Seeing(make_detector(settings), threshold)


def detect_balls(
    paths: Sequence[Path], output: Path, options: SeeingOptions, score: Path | None, *, as_json: bool
) -> None:
    """Find the ball in every image, write what is above the detector's threshold, and compare with boxes if asked."""
    refuse_output(output, "sightings are a CSV", ".csv")
    files = image_files(paths)
    if score is not None:
        for _ in scored_boxes(files, score):
            pass  # what is wrong with a file of boxes is told before the work
    seeing = open_seeing(options)
    own = set() if score is None or options.teach is None else {one.image.resolve() for one in labelled(options.teach)}
    own &= {file.resolve() for file in files}
    if own:
        render.note(f"{len(own)} of the images train the detector: each is scored by a training on the others alone")
    candidates: dict[Path, list[Sighting]] = {}
    for file in files:
        seen_by = open_seeing(options, without=file.resolve()) if file.resolve() in own else seeing
        candidates[file] = list(islice(seen_by.detector.candidates(read_image(file)), options.balls))
    found = {file: [one for one in some if one.score >= seeing.threshold] for file, some in candidates.items()}
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("file", "u_px", "v_px", "radius_px", "score"))
    for file, sightings in found.items():
        for one in sightings:
            u, v = one.centre_px
            rows.writerow((str(file), f"{u:.2f}", f"{v:.2f}", f"{one.radius_px:.2f}", f"{one.score:.4f}"))
    write_output(output, text.getvalue().encode())
    seen = sum(bool(sightings) for sightings in found.values())
    figures = {"images": len(files), "seen": seen, "threshold": seeing.threshold, "output": str(output)}
    scored = None if score is None else dataclasses.asdict(compare(candidates, score, seeing.threshold))
    if as_json:
        render.document(figures | ({} if scored is None else scored))
        return
    render.text(f"{output}: the ball is seen in {seen} of {len(files)} images (score {seeing.threshold:g} or more)")
    if scored is not None:
        render.table([(name, render.figure(value)) for name, value in scored.items()])


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
