"""kendama camera: a board to print, a calibration from its views, and a check of what cameras see."""

import json
import re

import cv2
import matplotlib
import numpy as np
import pytest
import yaml

from kendama_cli.plugins.calibration.boards import judged
from kendama_cli.plugins.calibration.calibration import CalibratedCamera
from tests.cli.typed import kendama, refused
from tests.plugins.calibration.board_views import BOARD, pair, poses, view


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Views of both cameras, one of them without a board."""
    home = tmp_path_factory.mktemp("views")
    for model in pair():
        folder = home / model.name
        folder.mkdir()
        for i, pose in enumerate(poses(7, seed=10010)):
            cv2.imwrite(str(folder / f"{i}.png"), view(model, pose, seed=i))
        cv2.imwrite(str(folder / "nothing.png"), np.full((480, 640, 3), 90, dtype=np.uint8))
    return home


def test_a_printed_board_is_found_again_at_its_size(here, capsys):
    code, out, _ = kendama(capsys, "camera", "board", "-o", "board.png", "--square-mm", "30", "--marker-mm", "22")
    assert code == 0
    assert "300 dpi" in out
    picture = cv2.imread("board.png")
    assert picture.shape[1] == pytest.approx((7 * 30 + 30) / 25.4 * 300, abs=8)
    assert picture.shape[0] == pytest.approx((5 * 30 + 30) / 25.4 * 300, abs=8)


def test_a_board_as_pdf_has_its_true_size_and_a_line_to_check_it(here, capsys, monkeypatch):
    """Read in the page's own operators: 72 points an inch."""
    monkeypatch.setitem(matplotlib.rcParams, "pdf.compression", 0)
    code, out, _ = kendama(capsys, "camera", "board", "--square-mm", "25", "--marker-mm", "18")
    assert code == 0
    assert "check the line with a ruler" in out
    text, mm = (here / "board.pdf").read_bytes().decode("latin-1"), 72 / 25.4
    page = [float(one) / mm for one in re.search(r"MediaBox \[([-\d. ]+)\]", text)[1].split()]
    assert page[2:] == pytest.approx([8 * 25, 6 * 25 + 10], abs=0.05)
    width, height = re.search(r"([\d.]+) 0 0 -([\d.]+) 0\s+[\d.]+ cm\s+/I1 Do", text).groups()
    assert (float(width) / mm, float(height) / mm) == pytest.approx((8 * 25, 6 * 25), abs=0.05)
    ((begin, end),) = re.findall(r"([\d.]+) [\d.]+ m\s+([\d.]+) [\d.]+ l\s+S", text)
    assert (float(end) - float(begin)) / mm == pytest.approx(100, abs=0.05)


@pytest.mark.parametrize(
    ("rms_px", "line"),
    [
        (0.29, None),
        (0.4, "left: 0.40 px is more than usual, below 0.3 is usual"),
        (0.8, "left: 0.80 px is poor, below 0.3 is usual"),
    ],
)
def test_residuals_are_judged(rms_px, line):
    residuals = np.array([[rms_px, 0.0], [0.0, -rms_px]])
    assert judged(CalibratedCamera(pair()[0], np.ones(4), (), np.array([rms_px]), (residuals,))) == line


def test_calibrate_writes_a_file_that_the_cameras_take_and_a_picture(folders, here, capsys):
    code, out, err = kendama(
        capsys, "camera", "calibrate", str(folders / "left"), str(folders / "right"), "--board-at", "0.1,0,-0.5",
        "-o", "calibration.yaml", "--json",
    )  # fmt: skip
    assert code == 0, err
    shown = json.loads(out)
    assert [one["name"] for one in shown["cameras"]] == ["left", "right"]
    assert set(shown["reprojection"]["left"]["views_px"]) == {str(i) for i in range(7)}
    assert shown["reprojection"]["left"]["rms_px"] < 0.3
    assert "left, nothing: the board is not seen" in err
    assert cv2.imread(shown["picture"]).shape == (480, 1280, 3)
    for one, true in zip(yaml.safe_load((here / "calibration.yaml").read_text())["cameras"], pair(), strict=True):
        assert np.abs(np.array(one["position_m"]) - (0.1, 0, -0.5) - true.position_in_world_m).max() < 0.006
    code, out, err = kendama(
        capsys, "camera", "check", "camera.calibration=calibration.yaml", "--seconds", "0.05", "--json"
    )
    assert code == 0, err
    assert set(json.loads(out)["cameras"]) == {"left", "right"}
    content = (here / "calibration.yaml").read_text()
    (here / "other.yaml").write_text(content.replace("name: left", "name: window"))
    line = refused(capsys, "camera", "check", "camera.calibration=other.yaml")
    assert "it calibrates the cameras window, right, but 'camera.cameras' names 'left'; calibrate all cameras" in line


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["gone"], "gone: no such file or folder; give a folder of images, or a video"),
        (["empty"], "empty: it holds no image; images end in .png"),
        (["empty/../video.mp4"], "OpenCV cannot read it as a video; convert it"),
        (["two"], "two/b.png: its image 'b' is 32 x 24 px after 64 x 48 px; calibrate images of one size at a time"),
        (["broken"], "broken/a.png: it is not an image that OpenCV can read; remove or convert it"),
        (["two/a.png"], "two/a.png: camera 'two': the board is seen in 0 images, at least 4 are needed"),
        (["one/left", "other/left"], "other/left: two cameras would be called 'left'; rename a folder or video"),
        (["two", "--board", "7by5"], "--board 7by5: allowed are COLUMNSxROWS of 3 to 22 squares each, such as 7x5"),
        (["two", "--marker-mm", "40"], "--marker-mm 40: a marker must lie within its square of 30 mm"),
        (["two", "--board-at", "1,2"], "--board-at 1,2: give three numbers in metres, such as 0,0,-0.55"),
    ],
)
def test_what_cannot_be_calibrated_is_told_in_one_line(here, capsys, words, message):
    for folder in ("empty", "two", "broken", "one/left", "other/left"):
        (here / folder).mkdir(parents=True)
    for folder in ("one/left", "other/left"):
        cv2.imwrite(str(here / folder / "a.png"), np.zeros((48, 64, 3), dtype=np.uint8))
    cv2.imwrite(str(here / "two" / "a.png"), np.zeros((48, 64, 3), dtype=np.uint8))
    cv2.imwrite(str(here / "two" / "b.png"), np.zeros((24, 32, 3), dtype=np.uint8))
    (here / "broken" / "a.png").write_bytes(b"no image")
    (here / "video.mp4").write_bytes(np.random.default_rng(0).bytes(3000))
    assert message in refused(capsys, "camera", "calibrate", *words)
    assert not (here / "calibration.yaml").exists()


def test_the_tests_board_is_the_commands_default():
    assert (BOARD.columns, BOARD.rows, BOARD.square_m, BOARD.marker_m) == (7, 5, 0.030, 0.022)
