"""Table of the corpus: labelled frames of each film by five training frames and by two nulls.

    python -m tests.films.table FOLDER [NAME ...]

A row has the frames that are right of those with a ball, those claimed of those without, and those of a ball that are
said to be 'not found'. A film without a ball is searched for that of the film of the same whiteboard.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from kendama_cli.plugins.films.ball_box import BallBox, TrainedImage
from kendama_cli.plugins.films.ball_film import FilmTrack, film_track
from kendama_cli.plugins.films.settings import TrainedDetectorSettings
from kendama_cli.plugins.films.trained_detector import TrainedDetector
from kendama_cli.plugins.films.training import TrainedBall, teach
from tests.films.corpus import CorpusFilm, Label, Places, films, roundest_moving_blob, share_right, trained_apart
from tests.films.corpus import template_matching as matched
from tests.shipped_conf import plain

RATE_HZ, ANOTHER = 30.0, "whiteboard"


def taught_by(film: CorpusFilm, others: list[CorpusFilm]) -> tuple[list[np.ndarray], list[TrainedImage], list[Label]]:
    """The film's images, those with boxes that teach its ball, and the labels that it was not taught by."""
    images = film.frames()
    shown, held_out = trained_apart(film.labels)
    source = images
    if not shown:
        other = next(one for one in others if one.name == ANOTHER)
        source, (shown, _) = other.frames(), trained_apart(other.labels)
    boxes: dict[int, list[BallBox]] = {}
    for one in shown:
        boxes.setdefault(one.frame, []).append(BallBox(one.x_px, one.y_px, 2 * one.radius_px, 2 * one.radius_px))
    return images, [TrainedImage(source[frame], tuple(own)) for frame, own in boxes.items()], held_out


def tracked(name: str, images: list[np.ndarray], ball: TrainedBall, colours_of: list[TrainedImage]) -> FilmTrack:
    """Track the ball as ``camera track`` does."""
    settings = TrainedDetectorSettings(**plain("predict/detector", "trained"))
    return film_track(
        name,
        lambda: ((k / RATE_HZ, image) for k, image in enumerate(images)),
        TrainedDetector(settings, ball),
        settings.score_min,
        colours_of,
    )


def places(track: FilmTrack) -> Places:
    """The ball's place in each frame of the track."""
    pairs = zip(track.frame, track.centre_px, strict=True)
    return {int(frame): (float(u), float(v)) for frame, (u, v) in pairs}


def searched(film: CorpusFilm, others: list[CorpusFilm]) -> Iterator[tuple[str, Places, list[Label]]]:
    """Yield each detector's name, its places in the film, and the labels that it was not taught by."""
    images, taught, held_out = taught_by(film, others)
    ball = teach(taught, 0)
    for name, colours_of in (("trained", taught), ("trained, not placed", [])):
        yield name, places(tracked(film.name, images, ball, colours_of)), held_out
    shown, _ = trained_apart(film.labels)
    if shown:
        yield "template", matched(images, shown[len(shown) // 2]), held_out
    yield "moving blob", roundest_moving_blob(images), held_out


if __name__ == "__main__":
    folder, *names = sys.argv[1:]
    corpus = films(Path(folder))
    for each in corpus:
        if each.name in (names or [each.name]) and each.path.exists():
            for name, found, labels in searched(each, corpus):
                right, of, false, empty = share_right(found, labels)
                missed = len({one.frame for one in labels if one.radius_px} - set(found))
                row = f"{right}/{of} | {false}/{empty} | {missed}/{of}"
                print(f"| {each.name} | {name} | {row} |", flush=True)
