"""The printed marker is found again in its picture, and has the size that was asked for."""

from __future__ import annotations

import re

import cv2
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


def test_the_pdf_has_the_declared_size_with_a_white_cell_on_either_side(tmp_path):
    print_marker("4x4_50", 0, 40.0, tmp_path / "marker.pdf")
    content = (tmp_path / "marker.pdf").read_text("latin-1")
    side = 40.0 * 8 / 6 / 25.4 * 72
    found = re.search(r"MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", content)
    assert [float(one) for one in found.groups()] == pytest.approx([side, side], abs=1e-3)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("7x7", 0, 40.0, "a.png"), "--dictionary 7x7: allowed are 4x4_50"),
        (("4x4_50", 50, 40.0, "a.png"), "--number 50: 4x4_50 has the markers 0 to 49"),
        (("4x4_50", 0, 40.0, "a.bmp"), "allowed are .png, .pdf"),
    ],
)
def test_what_cannot_be_printed_is_told(tmp_path, arguments, told):
    with pytest.raises(UsageError, match=re.escape(told)):
        print_marker(*arguments[:3], tmp_path / arguments[3])
