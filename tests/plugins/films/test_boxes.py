"""Files of boxes: what is wrong with one is told with its name and line."""

import cv2
import pytest

from kendama_cli.errors import InputError
from kendama_cli.plugins.films.boxes import labelled, read_boxes
from kendama_cli.plugins.suites.detector import disc_image


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("0 0.5 0.5 0.1", "has 4 columns in place of 5"),
        ("0 0.5 0.5 0.1 0.1 0.9", "has 6 columns in place of 5"),
        ("0 0.5 half 0.1 0.1", "is no box: not all are numbers"),
        ("0 1.5 0.5 0.1 0.1", "lies outside of the image: values are 0 to 1"),
        ("0 0.5 -0.1 0.1 0.1", "lies outside of the image: values are 0 to 1"),
        ("0 320 200 40 38", "lies outside of the image: values are 0 to 1"),
        ("0 nan 0.5 0.1 0.1", "lies outside of the image: values are 0 to 1"),
        ("0 0.5 0.5 0 0.1", "is a box without size"),
    ],
)
def test_a_line_that_is_no_box_is_named(tmp_path, line, problem):
    (tmp_path / "a.txt").write_text(f"0 0.5 0.5 0.1 0.1\n\n{line}\n")
    with pytest.raises(InputError, match=f"a.txt, line 3: '{line}' {problem}; boxes are YOLO text files"):
        read_boxes(tmp_path / "a.txt", 160, 120)


def test_boxes_of_an_image_that_is_not_there_are_named(tmp_path):
    for part in ("images", "labels"):
        (tmp_path / part).mkdir()
    cv2.imwrite(str(tmp_path / "images" / "a.png"), disc_image())
    for name in ("a", "classes"):
        (tmp_path / "labels" / f"{name}.txt").write_text("0 0.5 0.5 0.1 0.1\n")
    assert len(labelled(tmp_path)) == 1
    (tmp_path / "labels" / "b.txt").write_text("0 0.5 0.5 0.1 0.1\n")
    with pytest.raises(InputError, match=r"b\.txt: there is no image of its name; add the image to images/"):
        labelled(tmp_path)
