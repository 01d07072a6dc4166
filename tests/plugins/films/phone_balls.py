"""A trained ball in single images of phone videos with people and a moving camera: how much of its recall it has.

    python -m tests.plugins.films.phone_balls FOLDER TABLE.csv VIDEO [LAST_SEED [MINUTES [BOXES]]]

FOLDER has ``images/`` and ``labels/`` (YOLO); VIDEO is how the names of one video's images begin. Each draw trains on
BOXES of its images with a ball, sampled at random, and looks at all others: the part in which the best peak is the
ball, recall at precision 0.9, and recall and precision at the detector's own threshold. Draws that stand in the table
are left out, and after MINUTES no further one is begun.
"""

from __future__ import annotations

import csv
import sys
import time
from pathlib import Path

import numpy as np

from kendama_cli.plugins.films.boxes import LabelledImage, labelled, read_labelled
from kendama_cli.plugins.films.detect import compare
from kendama_cli.plugins.films.settings import TrainedDetectorSettings
from kendama_cli.plugins.films.trained_detector import TrainedDetector
from kendama_cli.plugins.films.training import teach
from tests.shipped_conf import plain

FIRST_SEED = 50300
COLUMNS = ("video", "boxes", "seed", "best_peak", "recall_at_precision_90", "recall", "precision")


def draw(images: list[LabelledImage], labels: Path, seed: int, boxes: int) -> list[float]:
    """The figures of one draw."""
    shown = [one for one in images if one.label.is_file() and one.label.read_text().strip()]
    rng = np.random.default_rng(seed)
    chosen = {shown[i].image for i in rng.choice(len(shown), boxes, replace=False)}
    settings = TrainedDetectorSettings(**plain("predict/detector", "trained"))
    detector = TrainedDetector(settings, teach([read_labelled(one) for one in shown if one.image in chosen], seed))
    candidates = {
        one.image: list(detector.candidates(read_labelled(one).pixels))[:1] for one in images if one.image not in chosen
    }
    made, best = compare(candidates, labels, settings.score_min), compare(candidates, labels, 0.0)
    values = (best.recall, made.recall_at_precision_90, made.recall, made.precision)
    return [round(value or 0.0, 4) for value in values]


def main() -> None:
    """Fill the table, and print the means with intervals over draws."""
    folder, path, video = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    last, minutes, boxes = ([int(one) for one in sys.argv[4:]] + [FIRST_SEED + 7, 600, 5][len(sys.argv) - 4 :])[:3]
    end_s = time.monotonic() + 60 * minutes
    images = [one for one in labelled(folder) if one.image.name.startswith(video)]
    if not path.exists():
        path.write_text(",".join(COLUMNS) + "\n")
    there = {(one["video"], one["boxes"], one["seed"]) for one in csv.DictReader(path.open())}
    for seed in range(FIRST_SEED, last + 1):
        if (video, str(boxes), str(seed)) not in there and time.monotonic() < end_s:
            row = draw(images, folder / "labels", seed, boxes)
            with path.open("a") as file:
                csv.writer(file, lineterminator="\n").writerow([video, boxes, seed, *row])
    own = [one for one in csv.DictReader(path.open()) if (one["video"], one["boxes"]) == (video, str(boxes))]
    rng = np.random.default_rng(0)
    table = np.array([[float(one[name]) for name in COLUMNS[3:]] for one in own])
    drawn = table[rng.integers(0, len(table), (2000, len(table)))].mean(axis=1)
    for k, name in enumerate(COLUMNS[3:]):
        low, high = np.quantile(drawn[:, k], (0.025, 0.975))
        over = drawn[:, k] / drawn[:, 0]
        of_best = (
            f"; over the best peak {table[:, k].mean() / table[:, 0].mean():.3f} [{np.quantile(over, 0.025):.3f}, "
        )
        print(f"{name}: {table[:, k].mean():.3f} [{low:.3f}, {high:.3f}]{of_best}{np.quantile(over, 0.975):.3f}]")


if __name__ == "__main__":
    main()
