"""Joints of a BVH, placed by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kendama_cli.errors import InputError
from kendama_cli.plugins.shared.recordings.reader import read_bodies

TEXT = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Hand
  {
    OFFSET 10 0 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 5 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.01
1 2 3 0 0 0 0 0 0
1 2 3 90 90 0 90 0 0
"""


def test_a_joint_stands_where_its_parents_carry_it(tmp_path: Path) -> None:
    """A turn by 90 degrees about z takes the offset from x to y; that about x comes after it and leaves it there."""
    file = tmp_path / "a.bvh"
    file.write_text(TEXT)
    hips, hand = read_bodies(str(file), "cm")
    assert (hips.name, hand.name) == ("Hips", "Hand")
    assert hand.t_s == pytest.approx([0.0, 0.01])
    assert hips.position_m == pytest.approx(np.array([[0.01, 0.02, 0.03]] * 2))
    assert hand.position_m == pytest.approx(np.array([[0.11, 0.02, 0.03], [0.01, 0.12, 0.03]]))
    assert hips.rotation_wxyz is not None
    assert hips.rotation_wxyz[1] == pytest.approx([0.5, 0.5, 0.5, 0.5])  # z by 90 then the turned x by 90


@pytest.mark.parametrize("cut", ["Frames: 2", "90 90 0 90", "JOINT"])
def test_a_damaged_file_is_refused_in_one_line(tmp_path: Path, cut: str) -> None:
    file = tmp_path / "a.bvh"
    file.write_text(TEXT[: TEXT.index(cut)] + "\n")
    with pytest.raises(InputError, match="the BVH is damaged"):
        read_bodies(str(file), "cm")


def test_a_unit_is_asked_for(tmp_path: Path) -> None:
    file = tmp_path / "a.bvh"
    file.write_text(TEXT)
    with pytest.raises(InputError, match=r"does not tell its unit; type: kendama capture layout .*a\.bvh"):
        read_bodies(str(file))
