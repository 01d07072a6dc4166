"""Balls in public films that nobody here made: five training boxes beside two nulls in the same run."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import pytest

from tests.cli.typed import kendama
from tests.films.corpus import (
    CorpusFilm,
    Label,
    films,
    roundest_moving_blob,
    share_right,
    template_matching,
    trained_apart,
)

BELOW = {"dark-green": 3, "dark-blue": 2, "red-bounce": 2}
"""Frames by which the trained ball is below the better null: balls of 12 px in the dark, and one clear film."""
CLAIMED = {"dark-green": 2, "hand-green4": 9}
"""Frames without a ball in which one is claimed: of the hand that held it, and of the dark."""
FOLDER = Path(os.environ.get("KENDAMA_FILMS", "films-not-fetched"))


def test_labels_are_of_frames_that_the_films_have_and_of_balls_inside_them() -> None:
    with (Path(__file__).parent / "films.csv").open() as file:
        told = {row["name"]: row for row in csv.DictReader(file)}
    assert {film.name for film in films(FOLDER)} == set(told)
    for film in films(FOLDER):
        row, labels = told[film.name], film.labels
        assert len({one.frame for one in labels}) >= 15
        assert len(set(labels)) == len(labels)
        assert max(one.frame for one in labels) < int(row["frames"])
        shown = [one for one in labels if one.radius_px]
        assert all(0 < one.x_px < int(row["width_px"]) and 0 < one.y_px < int(row["height_px"]) for one in shown)


@pytest.mark.parametrize("film", films(FOLDER), ids=lambda film: film.name)
def test_a_film_has_the_frames_and_the_size_that_its_row_tells(film: CorpusFilm) -> None:
    if not film.path.exists():
        pytest.skip(f"{film.path} is not there: python -m tests.films.corpus FOLDER, then KENDAMA_FILMS=FOLDER")
    with (Path(__file__).parent / "films.csv").open() as file:
        row = next(row for row in csv.DictReader(file) if row["name"] == film.name)
    images = film.frames()
    assert (len(images), *images[0].shape[:2]) == (int(row["frames"]), int(row["height_px"]), int(row["width_px"]))


def test_a_place_is_right_within_half_a_radius_and_a_claim_without_a_ball_is_false() -> None:
    labels = [Label(0, 10, 10, 20), Label(1, 10, 10, 20), Label(2, 0, 0, 0), Label(3, 0, 0, 0)]
    assert share_right({0: (19, 10), 1: (21, 10), 3: (5, 5)}, labels) == (1, 2, 1, 2)


def test_a_frame_with_two_balls_is_one_frame_and_either_ball_is_right() -> None:
    labels = [Label(0, 10, 10, 20), Label(0, 90, 10, 8), Label(1, 10, 10, 20), Label(1, 90, 10, 8)]
    assert share_right({0: (91, 10), 1: (50, 10)}, labels) == (1, 2, 0, 0)


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize(
    "film", [one for one in films(FOLDER) if trained_apart(one.labels)[0]], ids=lambda film: film.name
)
def test_five_training_frames_are_not_below_the_nulls(film: CorpusFilm, tmp_path: Path, capsys) -> None:
    if not film.path.exists():
        pytest.skip(f"{film.path} is not there: python -m tests.films.corpus FOLDER, then KENDAMA_FILMS=FOLDER")
    shown, held_out = trained_apart(film.labels)
    boxes = [
        f"--box={one.frame}:{max(one.x_px - one.radius_px, 0):.0f},{max(one.y_px - one.radius_px, 0):.0f},"
        f"{2 * one.radius_px:.0f},{2 * one.radius_px:.0f}"
        for one in shown
    ]
    code, _, err = kendama(capsys, "camera", "track", str(film.path), "-o", str(tmp_path / "track.csv"), *boxes)
    assert code == 0, err
    with (tmp_path / "track.csv").open() as file:
        found = {int(float(row["frame"])): (float(row["u_px"]), float(row["v_px"])) for row in csv.DictReader(file)}
    images = film.frames()
    rows = {
        "trained": share_right(found, held_out),
        "template": share_right(template_matching(images, shown[len(shown) // 2]), held_out),
        "moving blob": share_right(roundest_moving_blob(images), held_out),
    }
    with capsys.disabled():
        for name, (right, of, false, empty) in rows.items():
            print(f"\n{film.name:12} {name:12} right {right}/{of}, claimed without a ball {false}/{empty}", end="")
    best = max(rows["template"][0], rows["moving blob"][0])
    # a frame of these few is +-1 of a blurred label
    assert rows["trained"][0] >= best - BELOW.get(film.name, 1)
    assert rows["trained"][2] <= max(CLAIMED.get(film.name, 0), 0.02 * rows["trained"][3] + 1)
