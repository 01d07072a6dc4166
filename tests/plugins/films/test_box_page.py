"""kendama camera train FILM: boxes dragged in a real browser, written as images and labels that teach the ball."""

import re
import subprocess
import sys
import threading
import urllib.error
import urllib.request

import numpy as np
import pytest

from kendama_cli.plugins.films.boxes import labelled, read_labelled
from kendama_cli.plugins.films.draw import BoxPage
from kendama_cli.plugins.films.drawn_boxes import DrawnBoxes, different, film_stills
from kendama_cli.plugins.shared.videos.video import VideoFile
from kendama_cli.plugins.shared.web.loopback import listen
from tests.chromium import CHROMIUM, browser
from tests.cli.typed import refused
from tests.vision.ball_films import pendulum, textured, write_film

RADIUS_PX = 7.0
WALL = (20.0, 180.0, 70.0, 230.0)
ARROWS = ((("ArrowLeft", 37), ("ArrowRight", 39)), (("ArrowUp", 38), ("ArrowDown", 40)))
in_chromium = pytest.mark.skipif(CHROMIUM is None, reason="needs the program chromium (Debian: apt install chromium)")


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """A film of a ball on a string before a wall that has a plain part, and where the ball is in each frame."""
    wall = textured(10500)
    left, top, right, bottom = map(int, WALL)
    wall[top:bottom, left:right] = 150
    frames, truth = pendulum(120, 10501, background=wall)
    path = tmp_path_factory.mktemp("film") / "swing.avi"
    write_film(path, frames)
    return path, truth


class Teaching:
    """The command at work in a process of its own."""

    def __init__(self, film, folder):
        words = ["-m", "kendama_cli.cli.main", "camera", "train", str(film), "-o", str(folder), "--no-show"]
        self.process = subprocess.Popen(
            [sys.executable, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self.address = self.process.stdout.readline().strip()

    def ends(self):
        out, err = self.process.communicate(timeout=60)
        assert self.process.returncode == 0, err
        return out.splitlines()


@pytest.fixture
def teaching(film, tmp_path):
    begun = []

    def begin():
        begun.append(Teaching(film[0], tmp_path / "boxes"))
        return begun[-1]

    yield begin
    for one in begun:
        one.process.kill()
        one.process.communicate()


def shown(tab):
    tab.wait("window.kendama && kendama.state && kendama.ready")
    return tab


def screen(tab, u, v):
    x, y = tab.value(f"kendama.toScreen([{u}, {v}])")
    left, top = tab.value("(r => [r.left, r.top])(document.getElementById('view').getBoundingClientRect())")
    return left + x, top + y


def drag(tab, box, *, touch=False):
    """Drag from corner to corner of a box (left, top, right, bottom) [px of the image]."""
    first, last = screen(tab, *box[:2]), screen(tab, *box[2:])
    ways = [first, *(tuple(np.array(first) + part * (np.array(last) - first)) for part in (0.3, 0.7, 1.0))]
    for k, (x, y) in enumerate(ways):
        if touch:
            kind = "touchMove" if k else "touchStart"
            tab("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": x, "y": y}])
        else:
            kind = "mouseMoved" if k else "mousePressed"
            tab("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)
    if touch:
        tab("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    else:
        tab("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, button="left", buttons=0, clickCount=1)


def tap(tab, u, v):
    x, y = screen(tab, u, v)
    tab("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
    tab("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])


def press_key(tab, key, code):
    for kind in ("keyDown", "keyUp"):
        tab("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code)


def about_the_ball(truth, frame):
    u, v = truth[frame] + 0.5
    return u - RADIUS_PX, v - RADIUS_PX, u + RADIUS_PX, v + RADIUS_PX


def teach_frames(tab, truth, count, *, touch=False):
    for _ in range(count):
        frame = tab.value("kendama.frame")
        if touch:
            tap(tab, *(truth[frame] + 20))  # closer
        drag(tab, about_the_ball(truth, frame), touch=touch)
        tab.wait(f"{frame} in kendama.state.boxes")
        tab.value("document.getElementById('next').click()")
        shown(tab)


@pytest.mark.slow
@in_chromium
def test_boxes_dragged_by_mouse_finger_and_key_are_written_about_the_ball(film, teaching, tmp_path):
    path, truth = film
    begun = teaching()
    with browser(tmp_path / "profile") as chromium:
        tab = shown(chromium.open(begun.address))
        teach_frames(tab, truth, 2)
        assert tab.value("document.getElementById('done').disabled")

        frame = tab.value("kendama.frame")
        drag(tab, (30, 190, 60, 220))  # the plain wall
        tab.wait("document.getElementById('about').textContent.includes('Bare wall?')")
        assert "show no ball" in tab.value("kendama.state.missing") or "least" in tab.value("kendama.state.missing")
        press_key(tab, "Delete", 46)
        tab.wait(f"!({frame} in kendama.state.boxes)")
        press_key(tab, "Enter", 13)
        tab.wait("kendama.box")
        for axis, (less, more) in enumerate(ARROWS):
            steps = round(truth[frame][axis] + 0.5 - RADIUS_PX - tab.value(f"kendama.box[{axis}]"))
            for _ in range(abs(steps)):
                press_key(tab, *(more if steps > 0 else less))
        tab.wait(f"kendama.state.boxes[{frame}] && !kendama.state.warnings[{frame}]")
        tab.picture(tmp_path / "wide.png")

        phone = shown(chromium.open(begun.address, 390, 844, phone=True))
        teach_frames(phone, truth, 1, touch=True)
        assert phone.value("document.documentElement.scrollWidth") <= 390
        phone.value("document.getElementById('none').click()")
        phone.wait("Object.values(kendama.state.boxes).some(sides => !sides.length)")
        phone.picture(tmp_path / "phone.png")
        phone.wait("!document.getElementById('done').disabled")
        phone.value("document.getElementById('done').click()")
        command = phone.wait("document.getElementById('command').textContent")
        assert tab.said == phone.said == []

    said = begun.ends()
    folder = tmp_path / "boxes"
    assert said == [f"{folder}: 4 boxes, and 1 images without the ball", command]
    assert command == f"kendama camera track {path} --train {folder} -o swing.csv"
    films = dict(enumerate(pixels for _, pixels in VideoFile(path).frames()))
    written = {int(one.image.stem.split("-")[1]): read_labelled(one) for one in labelled(folder)}
    assert sum(bool(image.boxes) for image in written.values()) == 4
    for frame, image in written.items():
        assert np.array_equal(image.pixels, films[frame])  # no trace of the JPEG that was shown
        for box in image.boxes:
            assert np.hypot(box.u_px - truth[frame][0], box.v_px - truth[frame][1]) < 1.5  # a key's step, the screen's
            assert box.radius_px == pytest.approx(RADIUS_PX, abs=1.0)

    again = teaching()  # what was drawn is there again
    state = urllib.request.urlopen(again.address.replace("/?", "/state?"), timeout=20).read().decode()
    assert {int(frame) for frame in re.findall(r'"(\d+)": \[', state)} == set(written)


@pytest.fixture(scope="module")
def served(film):
    """The address of the page of a film without boxes, served by this process."""
    drawn = DrawnBoxes(film_stills(VideoFile(film[0])), {})
    page = BoxPage(listen("127.0.0.1", 0), drawn, {}, list)
    threading.Thread(target=page.serve, daemon=True).start()
    return page.address


def test_only_who_has_the_token_is_served_and_what_is_no_box_is_refused(served):
    root, _, token = served.partition("?")

    def ask(path, sent=None):
        try:
            with urllib.request.urlopen(root + path, sent, timeout=20) as answer:
                return answer.status, answer.read().decode(), answer.headers
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode(), error.headers

    for path in ("", "state", "frame/0", "state?token=x"):
        assert ask(path)[0] == 403
    assert ask("done", b"{}")[0] == 403
    token = f"?{token}"
    status, page, headers = ask(token)
    assert status == 200
    assert "<script>" not in page
    assert headers["Content-Security-Policy"].startswith("default-src 'none'; script-src 'self'")
    for wrong in (b"", b"[]", b'{"frame": 0}', b'{"frame": 0, "box": [1, 1, 2, 2]}', b'{"frame": 9999, "box": []}'):
        assert ask("box" + token, wrong)[0] == 400
    assert ask("box" + token, b'{"frame": 0, "box": [NaN, 1, 20, 20]}')[0] == 400
    assert ask("box" + token, b" " * 20_000)[0] == 413
    status, said, _ = ask("done" + token, b"{}")
    assert (status, said) == (409, "0 boxes are drawn: 3 are the least\n")


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("none.mp4",), "no such video"),
        (("text.mp4",), "cannot read it as a video"),
        (("short.avi",), "it has 2 frames"),
        (("short.avi", "-o", "text.mp4"), "it is a file"),
    ],
)
def test_what_is_no_film_or_no_folder_is_told_in_one_line(tmp_path, monkeypatch, capsys, words, line):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.mp4").write_text("no film")
    write_film(tmp_path / "short.avi", [textured(10502)] * 2)
    assert line in refused(capsys, "camera", "train", *words, "--no-show")


def test_the_images_that_differ_are_offered():
    """Of ten parts of a film of one place each has one frame that shows another."""
    values = np.zeros((100, 10))
    values[4::10] = np.eye(10)
    assert different(values, 10) == list(range(4, 100, 10))
