"""The printed marker is found again in its picture, and has the size that was asked for."""

from __future__ import annotations

import re

import cv2
import numpy as np
import pytest

from kendama_cli.errors import UsageError
from kendama_cli.plugins.marker.detection import DICTIONARIES, MarkerDetector
from kendama_cli.plugins.marker.marker_print import print_marker


@pytest.mark.parametrize("dictionary", DICTIONARIES)
def test_the_png_holds_the_marker_in_its_size(tmp_path, dictionary):
    output = tmp_path / "marker.png"
    print_marker(dictionary, 3, 40.0, output)
    found = MarkerDetector(dictionary, 3).find(cv2.imread(str(output)))
    assert found is not None
    data = output.read_bytes()
    density = int.from_bytes(data[data.index(b"pHYs") + 4 :][:4], "big")
    assert found.side_px / density == pytest.approx(0.040, rel=0.005)


def test_svg_and_pdf_have_the_declared_size_and_the_same_cells(tmp_path):
    for name in ("marker.svg", "marker.pdf"):
        print_marker("4x4_50", 0, 40.0, tmp_path / name)
    svg, pdf = (tmp_path / "marker.svg").read_text(), (tmp_path / "marker.pdf").read_text("latin-1")
    side = 40.0 * 8 / 6  # with one white cell on either side
    assert f'width="{side:.4f}mm"' in svg
    assert float(re.search(r"MediaBox \[0 0 ([\d.]+)", pdf)[1]) == pytest.approx(side / 25.4 * 72, abs=1e-3)
    cells = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(DICTIONARIES["4x4_50"]), 0, 6) == 0
    assert svg.count("<rect x=") == pdf.count(" re f") == np.count_nonzero(cells)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("7x7", 0, 40.0, "a.png"), "--dictionary 7x7: allowed are 4x4_50"),
        (("4x4_50", 50, 40.0, "a.png"), "--number 50: 4x4_50 has the markers 0 to 49"),
        (("4x4_50", 0, 40.0, "a.bmp"), "allowed are .png, .svg, .pdf"),
    ],
)
def test_what_cannot_be_printed_is_told(tmp_path, arguments, told):
    with pytest.raises(UsageError, match=re.escape(told)):
        print_marker(*arguments[:3], tmp_path / arguments[3])
