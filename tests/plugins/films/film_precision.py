"""Precision and recall of tracks by five training frames, over all labelled frames of the corpus.

    python -m tests.plugins.films.film_precision FOLDER TABLE.csv [MINUTES]

writes a row for each labelled frame that did not teach: if it shows a ball, the track's score there (empty where no
ball is claimed), and if the place is right. Films that stand in the table are left out, and after MINUTES no further
one is begun. The last lines tell precision and recall of all claims, of the highest scores that keep a recall of 0.86,
and of those from which the other films keep it; intervals are bootstrapped over films.
"""

from __future__ import annotations

import csv
import sys
import time
from pathlib import Path

import numpy as np

from kendama_cli.plugins.films.training import teach
from tests.films.corpus import CorpusFilm, films, share_right
from tests.films.table import places, taught_by, tracked

COLUMNS = ("film", "frame", "ball", "score", "right")
RECALL = 0.86
SAMPLES = 2000


def rows(film: CorpusFilm, others: list[CorpusFilm]) -> list[tuple[str, int, int, str, int]]:
    """A row for each labelled frame that did not teach."""
    images, taught, held_out = taught_by(film, others)
    track = tracked(film.name, images, teach(taught, 0), taught)
    found, scores = places(track), dict(zip(track.frame.astype(int).tolist(), track.score.tolist(), strict=True))
    made = []
    for frame in sorted({one.frame for one in held_out}):
        labels = [one for one in held_out if one.frame == frame]
        right, of, _, _ = share_right(found, labels)
        made.append((film.name, frame, of, f"{scores[frame]:.4f}" if frame in scores else "", right))
    return made


def rates(table: np.ndarray, least: np.ndarray | float) -> tuple[float, float]:
    """Precision and recall of the claims with scores of ``least`` (n,) or more."""
    claimed, right = table[:, 1] >= least, table[:, 2] > 0
    hits = int((claimed & right).sum())
    return hits / max(int(claimed.sum()), 1), hits / max(int(table[:, 0].sum()), 1)


def threshold(table: np.ndarray) -> float:
    """The highest score from which the claims keep the RECALL; the lowest of all where none does."""
    scores = np.unique(table[np.isfinite(table[:, 1]), 1])
    return float(max((one for one in scores if rates(table, one)[1] >= RECALL), default=scores.min()))


def report(path: Path) -> None:
    """Print the rates."""
    with path.open() as file:
        read = list(csv.DictReader(file))
    names = np.array([one["film"] for one in read])
    table = np.array([(float(one["ball"]), float(one["score"] or -np.inf), float(one["right"])) for one in read])
    known = np.unique(names)
    held_out = np.zeros(len(table))
    for name in known:
        held_out[names == name] = threshold(table[names != name])
    rng = np.random.default_rng(0)
    drawn = [
        np.concatenate([np.flatnonzero(names == one) for one in rng.choice(known, len(known))]) for _ in range(SAMPLES)
    ]
    print(f"{len(known)} films, {len(table)} frames, {int(table[:, 0].sum())} with a ball")
    for told, least in (
        ("all claims", np.zeros(len(table))),
        (f"score {threshold(table):.2f} or more", np.full(len(table), threshold(table))),
        ("score chosen by the other films", held_out),
    ):
        values = [rates(table[one], least[one]) for one in drawn]
        bounds = np.quantile(values, (0.025, 0.975), axis=0).T
        pairs = zip(("precision", "recall"), rates(table, least), bounds, strict=True)
        print(
            f"{told}: " + ", ".join(f"{name} {value:.3f} [{low:.3f}, {high:.3f}]" for name, value, (low, high) in pairs)
        )


def main() -> None:
    """Fill the table, and print the rates."""
    folder, path = Path(sys.argv[1]), Path(sys.argv[2])
    end_s = time.monotonic() + 60 * float(sys.argv[3] if len(sys.argv) > 3 else 600)
    if not path.exists():
        path.write_text(",".join(COLUMNS) + "\n")
    corpus = films(folder)
    there = {one["film"] for one in csv.DictReader(path.open())}
    for film in corpus:
        if film.name not in there and time.monotonic() < end_s:
            made = rows(film, corpus)
            with path.open("a") as file:
                csv.writer(file, lineterminator="\n").writerows(made)
    report(path)


if __name__ == "__main__":
    main()
