"""Public films with labels: where they are fetched from, and what a detector finds in them beside two nulls.

    python -m tests.films.corpus FOLDER [--mirror FOLDER]

fetches the films of ``films.csv`` into FOLDER with git, from their repositories or from copies of them as
MIRROR/OWNER+NAME/repo, and checks their bytes. The films themselves are never part of the project. Labels were set by
eye, or proposed by colour or difference from the still background and then corrected by eye, each on an enlarged
picture: about 60 frames a film, chosen evenly, or all of a shorter one. A blurred ball is labelled at the middle of its
streak, with the radius across it. A row without a place has no ball; a frame with two balls has two rows, either is
right. Left out is a ball whose middle cannot be told, as the image's edge cuts it in half or a hand hides it.
"""

from __future__ import annotations

import csv
import hashlib
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

HERE = Path(__file__).parent
Places = dict[int, tuple[float, float]]


@dataclass(frozen=True)
class Label:
    """Position of the ball in a frame [px]; ``radius_px`` is 0 if the frame does not show it."""

    frame: int
    x_px: float
    y_px: float
    radius_px: float


@dataclass(frozen=True)
class CorpusFilm:
    """A film of ``films.csv``, which lies at ``path`` where it was fetched."""

    name: str
    repository: str
    commit: str
    inside: str
    sha256: str
    path: Path

    @property
    def labels(self) -> list[Label]:
        """The labelled frames."""
        with (HERE / "labels" / f"{self.name}.csv").open() as file:
            return [
                Label(int(row["frame"]), *(float(row[key] or 0) for key in ("x_px", "y_px", "radius_px")))
                for row in csv.DictReader(file)
            ]

    def frames(self) -> list[np.ndarray]:
        """All images (h, w, 3), blue green red."""
        video, images = cv2.VideoCapture(str(self.path)), []
        while (read := video.read())[0]:
            images.append(read[1])
        return images


def films(folder: Path) -> list[CorpusFilm]:
    """The films, as they would lie in ``folder``."""
    with (HERE / "films.csv").open() as file:
        return [
            CorpusFilm(
                row["name"], row["repository"], row["commit"], row["path"], row["sha256"],
                folder / f"{row['name']}{Path(row['path']).suffix.lower()}",
            )
            for row in csv.DictReader(file)
        ]  # fmt: skip


def share_right(found: Places, labels: list[Label]) -> tuple[int, int, int, int]:
    """Frames with a ball that are right, of how many; frames without one that are claimed, of how many.

    Right is within half a radius of a label, or 4 px, as the labels themselves are known to 1 to 3 px.
    """
    shown = {one.frame for one in labels if one.radius_px}
    empty = [one.frame for one in labels if not one.radius_px]
    right = {
        one.frame
        for one in labels
        if one.radius_px
        and one.frame in found
        and np.hypot(found[one.frame][0] - one.x_px, found[one.frame][1] - one.y_px) < max(one.radius_px / 2, 4.0)
    }
    return len(right), len(shown), sum(frame in found for frame in empty), len(empty)


def trained_apart(labels: list[Label], frames: int = 5, seed: int = 10000) -> tuple[list[Label], list[Label]]:
    """Labels of frames that teach, drawn at random, and those of all other frames.

    Of a film with few frames of the ball half of them teach.
    """
    shown = sorted({one.frame for one in labels if one.radius_px})
    count = min(frames, len(shown) // 2)
    chosen = set(np.random.default_rng(seed).choice(shown, count, replace=False).tolist()) if count else set()
    return [one for one in labels if one.frame in chosen], [one for one in labels if one.frame not in chosen]


def template_matching(images: list[np.ndarray], taught: Label) -> Places:
    """Null: the best match of one taught box in each image, where it correlates by more than one half."""
    half, found = round(taught.radius_px), {}
    rows, columns = (slice(max(round(middle) - half, 0), round(middle) + half) for middle in (taught.y_px, taught.x_px))
    box = images[taught.frame][rows, columns]
    for k, image in enumerate(images):
        _, score, _, (left, top) = cv2.minMaxLoc(cv2.matchTemplate(image, box, cv2.TM_CCOEFF_NORMED))
        if score > 0.5:
            found[k] = (left + box.shape[1] / 2, top + box.shape[0] / 2)
    return found


def roundest_moving_blob(images: list[np.ndarray]) -> Places:
    """Null: what differs from the median image, and of that the blob that fills its enclosing circle best."""
    still = np.median(np.stack(images[:: max(len(images) // 30, 1)]), axis=0).astype(np.uint8)
    found = {}
    for k, image in enumerate(images):
        changed = (cv2.absdiff(image, still).max(axis=2) > 25).astype(np.uint8)
        contours, _ = cv2.findContours(changed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        circles = [(cv2.contourArea(one), *cv2.minEnclosingCircle(one)) for one in contours]
        round_ones = [(area / (np.pi * r**2), middle) for area, middle, r in circles if r > 4]
        if round_ones:
            found[k] = max(round_ones)[1]
    return found


def fetch(film: CorpusFilm, mirror: Path | None) -> None:
    """Write the film; raises ValueError where its bytes are not those that were labelled."""
    if film.path.exists() and hashlib.sha256(film.path.read_bytes()).hexdigest() == film.sha256:
        return
    with tempfile.TemporaryDirectory() as scratch:
        copy = None if mirror is None else mirror / film.repository.replace("/", "+") / "repo"
        if copy is None:
            address = f"https://github.com/{film.repository}"
            subprocess.run(["git", "clone", "-q", "--bare", "--filter=blob:none", address, scratch], check=True)
        git = Path(scratch) if copy is None else copy / ".git" if (copy / ".git").is_dir() else copy
        command = ["git", f"--git-dir={git}", "show", f"{film.commit}:{film.inside}"]
        data = subprocess.run(command, capture_output=True, check=True).stdout
    if hashlib.sha256(data).hexdigest() != film.sha256:
        raise ValueError(f"{film.name}: its bytes are not those that were labelled")
    film.path.write_bytes(data)


if __name__ == "__main__":
    target, *options = sys.argv[1:]
    Path(target).mkdir(parents=True, exist_ok=True)
    for each in films(Path(target)):
        fetch(each, Path(options[1]) if options[:1] == ["--mirror"] else None)
        print(each.path)
