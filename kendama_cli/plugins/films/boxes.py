"""Images with boxes about the ball, as YOLO's text files beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2

from kendama_cli.errors import InputError
from kendama_cli.plugins.films.ball_box import BallBox, TrainedImage
from kendama_cli.plugins.shared.videos.video import read_image
from kendama_cli.plugins.shared.videos.views import IMAGES
from kendama_cli.schema.units import count_of

LAYOUT = (
    "boxes are YOLO text files (class, centre and size over the image's width and height) in labels/ beside images/"
)


COLUMNS = 5
NOT_BOXES = ("classes", "notes")
"""Files of these names lie beside the boxes that labelling programs write."""


@dataclass(frozen=True)
class LabelledImage:
    """An image's file and the file with its boxes; a missing or empty file of boxes says that there is no ball."""

    image: Path
    label: Path


def image_files(paths: Sequence[Path]) -> list[Path]:
    """Find the images among ``paths`` and in folders among them (a folder's own, or those of its ``images/``).

    Raises InputError for a path that is not there, is no image, or is a folder without one.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            folder = path / "images" if (path / "images").is_dir() else path
            inside = sorted(item for item in folder.iterdir() if item.suffix.lower() in IMAGES)
            if not inside:
                raise InputError(str(path), "it holds no image", remedy=f"images end in {', '.join(IMAGES)}")
            found += inside
        elif not path.is_file():
            raise InputError(str(path), "no such file or folder", remedy="give images, or folders of images")
        elif path.suffix.lower() not in IMAGES:
            raise InputError(str(path), "it is not an image", remedy="a film goes to 'kendama camera track'")
        else:
            found.append(path)
    return found


def labelled(folder: Path) -> list[LabelledImage]:
    """Find the images of a folder with their boxes: in ``images/`` and ``labels/``, or side by side.

    Raises InputError where there is no image, or not one file of boxes.
    """
    images = image_files([folder])
    made = []
    for image in images:
        name = image.with_suffix(".txt").name
        beside = image.parent.parent / "labels" / name
        made.append(LabelledImage(image, beside if image.parent.name == "images" else image.with_suffix(".txt")))
    if not any(one.label.is_file() for one in made):
        raise InputError(str(folder), f"none of its {len(made)} images has a file of boxes", remedy=LAYOUT)
    known = {one.label for one in made}
    for home in sorted({one.label.parent for one in made if one.label.parent.name == "labels"}):
        for label in sorted(home.glob("*.txt")):
            if label not in known and label.stem not in NOT_BOXES:
                raise InputError(
                    str(label), "there is no image of its name", remedy="add the image to images/, or delete the file"
                )
    return made


def read_boxes(label: Path, width_px: int, height_px: int) -> tuple[BallBox, ...]:
    """Read the boxes of one image of that size; raises InputError for a line that is no box within the image."""
    if not label.is_file():
        return ()
    boxes = []
    try:
        lines = label.read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError:
        raise InputError(str(label), "it is not text", remedy=LAYOUT) from None
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        u, v, width, height = _box(str(label), number, line)
        boxes.append(BallBox(u * width_px - 0.5, v * height_px - 0.5, width * width_px, height * height_px))
    return tuple(boxes)


def _box(label: str, number: int, line: str) -> tuple[float, float, float, float]:
    """Centre and size of the box in a line; raises InputError where it says none."""
    where, cells = f"line {number}", line.split()
    if len(cells) != COLUMNS:
        raise InputError(
            label,
            f"'{line[:60]}' has {count_of(len(cells), 'column')} in place of {COLUMNS}",
            where=where,
            remedy=LAYOUT,
        )
    try:
        _, u, v, width, height = (float(cell) for cell in cells)
    except ValueError:
        raise InputError(label, f"'{line[:60]}' is no box: not all are numbers", where=where, remedy=LAYOUT) from None
    if width <= 0 or height <= 0:
        raise InputError(label, f"'{line[:60]}' is a box without size", where=where, remedy=LAYOUT)
    if not (0 <= u <= 1 and 0 <= v <= 1 and 0 < width <= 1 and 0 < height <= 1):
        raise InputError(
            label, f"'{line[:60]}' lies outside of the image: values are 0 to 1", where=where, remedy=LAYOUT
        )
    return u, v, width, height


def read_labelled(one: LabelledImage) -> TrainedImage:
    """Read the image with its boxes."""
    pixels = read_image(one.image)
    return TrainedImage(pixels, read_boxes(one.label, pixels.shape[1], pixels.shape[0]))


def write_labelled(folder: Path, name: str, image: TrainedImage) -> None:
    """Write the image as ``images/NAME.png`` and its boxes as ``labels/NAME.txt``, in full precision."""
    height_px, width_px = image.pixels.shape[:2]
    lines = [
        f"0 {(box.u_px + 0.5) / width_px:.9g} {(box.v_px + 0.5) / height_px:.9g} "
        f"{box.width_px / width_px:.9g} {box.height_px / height_px:.9g}\n"
        for box in image.boxes
    ]
    for part, ending, content in (
        ("images", ".png", cv2.imencode(".png", image.pixels)[1].tobytes()),
        ("labels", ".txt", "".join(lines).encode()),
    ):
        (folder / part).mkdir(parents=True, exist_ok=True)
        (folder / part / f"{name}{ending}").write_bytes(content)
