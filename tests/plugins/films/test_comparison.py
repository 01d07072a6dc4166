"""kendama camera detect --score: thresholds by precision, and training images scored by the others alone."""

import csv
import json
import shutil

import cv2
import numpy as np
import pytest

from kendama_cli.plugins.films.detect import compare
from kendama_cli.vision.detection.interface import Sighting
from tests.cli.typed import kendama
from tests.vision.ball_films import write_labelled


def test_the_threshold_of_a_precision_is_the_lowest_that_has_it(tmp_path):
    """Ten images with a ball each: nine are found with scores of .99 to .91, the fifth detection is beside the ball."""
    candidates = {}
    for number in range(10):
        image, label = tmp_path / f"{number}.png", tmp_path / f"{number}.txt"
        cv2.imwrite(str(image), np.zeros((100, 100, 3), np.uint8))
        label.write_text("0 0.5 0.5 0.2 0.2\n")
        place = np.array([80.0, 80.0]) if number == 4 else np.array([51.5, 49.5])
        candidates[image] = [Sighting(place, np.eye(2), 10.0, 0.99 - number / 100)]
    told = compare(candidates, tmp_path, 0.955)
    assert (told.boxes, told.sightings, told.hits) == (10, 4, 4)
    assert (told.recall, told.precision) == (0.4, 1.0)
    assert told.error_radii_p50 == pytest.approx(0.2)
    assert (told.recall_at_precision_90, told.threshold_at_precision_90) == (0.9, pytest.approx(0.90))
    assert (told.recall_at_precision_99, told.threshold_at_precision_99) == (0.4, pytest.approx(0.96))
    best = candidates[tmp_path / "4.png"][0]
    surest_is_wrong = compare({tmp_path / "4.png": [best]}, tmp_path, 0.5)
    assert surest_is_wrong.recall_at_precision_90 is surest_is_wrong.threshold_at_precision_90 is None


@pytest.mark.slow
def test_a_training_image_is_scored_by_a_training_on_the_others(here, capsys):
    write_labelled(here / "boxes", range(10000, 10004))
    words = ["-o", "found.csv", "--override", "predict.detector.score_min=0.001", "--json"]
    score = ["--score", "boxes/labels"]
    code, out, err = kendama(capsys, "camera", "detect", "boxes", "--train", "boxes", *score, *words)
    assert code == 0, err
    assert "4 of the images train the detector: each is scored by a training on the others alone" in err
    assert json.loads(out)["recall_at_precision_90"] > 0
    (row,) = [row for row in read(here / "found.csv") if "10002" in row["file"]]
    shutil.copytree(here / "boxes", here / "others")
    for file in (here / "others").rglob("10002.*"):
        file.unlink()
    code, _, err = kendama(capsys, "camera", "detect", "boxes/images/10002.png", "--train", "others", *words)
    assert code == 0, err
    assert read(here / "found.csv") == [row]
    code, _, err = kendama(capsys, "camera", "detect", "boxes/images/10002.png", "--train", "boxes", *words)
    assert read(here / "found.csv")[0]["score"] != row["score"]


def read(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))
