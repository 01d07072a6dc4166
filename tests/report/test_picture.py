"""README's picture: made of a report by data/picture.py, with the page's headline figures in its file."""

from __future__ import annotations

import importlib.util
import zlib

import cv2
import numpy as np

from tests.shipped_conf import CONF

DATA = CONF.parent / "data"
_spec = importlib.util.spec_from_file_location("picture", DATA / "picture.py")
assert _spec is not None
assert _spec.loader is not None
_picture = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_picture)
figures_in, figures_of, with_figures = _picture.figures_in, _picture.figures_of, _picture.with_figures


def test_the_picture_holds_the_headline_figures_of_a_page(page, logs):
    figures = figures_of(page)
    assert len(figures) == 6
    assert figures["of swing-ups succeed on the twin"] == "95 %"
    whole, png = cv2.imencode(".png", np.arange(300, dtype=np.uint8).reshape(10, 10, 3))
    assert whole
    made = with_figures(png.tobytes(), figures)
    assert figures_in(made) == figures
    assert np.array_equal(cv2.imdecode(np.frombuffer(made, np.uint8), 1), cv2.imdecode(png, 1))
    start = made.index(b"tEXt")
    length = int.from_bytes(made[start - 4 : start], "big")
    assert int.from_bytes(made[start + 4 + length :][:4], "big") == zlib.crc32(made[start : start + 4 + length])


def test_the_bundled_picture_is_small_and_says_its_figures():
    content = (DATA / "pictures" / "report.png").read_bytes()
    assert len(content) < 1_000_000
    assert "time scale tau of the catch" in figures_in(content)
