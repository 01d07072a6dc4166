"""The replay in Chromium, by its pixels: arm, cup and ball are drawn and move; without WebGL it gives way."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import chromium as chromium_module
from tests.chromium import CHROMIUM, browser
from tests.report.replay.undrawn import undrawn_report

pytestmark = pytest.mark.skipif(
    CHROMIUM is None, reason="needs the program chromium (Debian: apt-get install chromium)"
)

SEEN = """(() => {
  const canvas = document.querySelector('.replay canvas'), flat = document.createElement('canvas');
  flat.width = canvas.width; flat.height = canvas.height;
  const pen = flat.getContext('2d'); pen.drawImage(canvas, 0, 0);
  const data = pen.getImageData(0, 0, flat.width, flat.height).data;
  const seen = {ball: [0, 0, 0], cup: [0, 0, 0], arm: [0, 0, 0]};
  for (let i = 0; i < data.length; i += 4) {
    const [r, g, b] = [data[i], data[i + 1], data[i + 2]];
    const what = r > 1.5 * g && r > 3 * b && r > 90 ? 'ball' : b > 2.2 * r && b > 1.2 * g ? 'cup'
      : Math.max(r, g, b) - Math.min(r, g, b) < 14 && r < 215 && r > 20 ? 'arm' : null;
    if (what) { const s = seen[what], k = i / 4; s[0]++; s[1] += k % flat.width; s[2] += Math.floor(k / flat.width); }
  }
  for (const s of Object.values(seen)) if (s[0]) { s[1] /= s[0] * flat.width; s[2] /= s[0] * flat.height; }
  return seen;
})()"""
TO = """(() => {{
  const slider = document.querySelector('.replay input[type=range]');
  slider.value = {time}; slider.dispatchEvent(new Event('input'));
  return document.querySelector('.replay output').textContent;
}})()"""
PRESS = """document.querySelector('.replay canvas').dispatchEvent(
  new KeyboardEvent('keydown', {{key: '{key}', cancelable: true}}))"""
ONE = "for (const box of [...document.querySelectorAll('.replay [data-index]')].slice(1)) if (box.checked) box.click()"
MIDDLE = """(() => {
  const box = document.querySelector('.replay canvas').getBoundingClientRect();
  scrollTo(0, scrollY + box.top - 40);
  return [box.left + box.width / 2, 40 + box.height / 2];
})()"""


@pytest.fixture(scope="module")
def report(tmp_path_factory, run, logs) -> Path:
    """The page without its chapters' figures, which matplotlib would take seconds for."""
    file = tmp_path_factory.mktemp("page") / "report.html"
    file.write_text(undrawn_report(run, logs, "capture", "adapt", "transfer"), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def in_space(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        options = ("--enable-unsafe-swiftshader", "--force-prefers-reduced-motion")
        patch.setattr(chromium_module, "OPTIONS", (*chromium_module.OPTIONS, *options))
        with browser(tmp_path_factory.mktemp("profile")) as made:
            yield made


def _opened(chromium, report: Path, *size: int, phone: bool = False):
    tab = chromium.open(report.as_uri(), *size, phone=phone)
    tab.wait("document.readyState === 'complete' && document.querySelector('.replay output').textContent")
    return tab


def test_arm_cup_and_ball_are_drawn_and_move_with_the_slider(in_space, report) -> None:
    tab = _opened(in_space, report, 1000, 800)
    tab.value(ONE)
    assert tab.value(TO.format(time=-0.3)).endswith("0.30 s")
    before = tab.value(SEEN)
    for what, least in (("ball", 60), ("cup", 60), ("arm", 3000)):
        assert before[what][0] > least, what
    tab.value(TO.format(time=-1.2))
    after = tab.value(SEEN)
    assert abs(after["ball"][1] - before["ball"][1]) + abs(after["ball"][2] - before["ball"][2]) > 0.02
    assert after["cup"][1:] != before["cup"][1:]
    assert tab.said == []
    tab.send("Page.close")


def test_it_turns_zooms_and_plays_by_keys_and_mouse(in_space, report) -> None:
    tab = _opened(in_space, report, 1000, 800)
    views = [tab.value(SEEN)]
    for key in ("ArrowLeft", "+", "+"):
        tab.value(PRESS.format(key=key))
    views.append(tab.value(SEEN))
    assert views[1]["arm"][0] > 1.1 * views[0]["arm"][0]
    tab.value(PRESS.format(key="r"))
    assert tab.value(SEEN) == views[0]
    middle = tab.value(MIDDLE)
    for kind, shift in (("mousePressed", 0), ("mouseMoved", 40), ("mouseMoved", 120), ("mouseReleased", 120)):
        tab("Input.dispatchMouseEvent", type=kind, x=middle[0] + shift, y=middle[1], button="left", buttons=1)
    assert tab.value(SEEN) != views[0]
    began = tab.value("document.querySelector('.replay output').textContent")
    tab.value("document.querySelector('.replay [data-rate=\"0.1\"]').click()")
    tab.value(PRESS.format(key=" "))
    tab.wait(f"document.querySelector('.replay output').textContent !== '{began}'")
    assert tab.value("document.querySelector('.replay .play').textContent") == "Pause"
    tab.value(PRESS.format(key=" "))
    assert tab.said == []
    tab.send("Page.close")


def test_side_by_side_and_overlaid_show_what_is_ticked(in_space, report) -> None:
    tab = _opened(in_space, report, 1000, 800)
    legends = "[...document.querySelectorAll('.replay .legend span')].map(one => one.textContent)"
    assert tab.value(legends) == ["Adapted swing, simulated", "Full game, twin"]
    two = tab.value(SEEN)["ball"][0]
    tab.value("document.querySelector('.replay [data-side=\"0\"]').click()")
    assert tab.value(legends) == ["Adapted swing, simulated, Full game, twin"]
    assert tab.value(SEEN)["ball"][0] != two
    assert tab.said == []
    tab.send("Page.close")


def test_the_cameras_images_stand_beside_the_scene_with_a_ring_about_the_ball(in_space, report) -> None:
    """Of the first game, of which alone there are images: at 106.6 s, ball found at (300, 200) px, and at 106.75 s."""
    tab = _opened(in_space, report, 1000, 800)
    caption = "document.querySelector('.replay .cameras figcaption').textContent"
    ring = (
        "(() => { const one = document.querySelector('.replay .cameras circle');"
        " return [one.getAttribute('cx'), one.getAttribute('cy'), one.style.display]; })()"
    )
    tab.value(TO.format(time=-1.0))
    first = tab.value(caption)
    assert first.startswith("Camera “left”, ")
    assert tab.value(ring) == ["300", "200", ""]
    image = "document.querySelector('.replay .cameras image')"
    tab.wait(f"{image}.getBoundingClientRect().width > 200")
    assert tab.value(f"{image}.getAttribute('href')").startswith("data:image/jpeg;base64,")
    tab.value(TO.format(time=9.0))
    assert tab.value(caption).endswith(", ball not found")
    assert tab.value(ring)[2] == "none"
    tab.value(ONE)
    assert tab.value("document.querySelector('.replay .cameras').hidden") is True
    assert tab.said == []
    tab.send("Page.close")


def test_it_fits_a_phone(in_space, report) -> None:
    tab = _opened(in_space, report, 390, 844, phone=True)
    assert tab.value("document.documentElement.scrollWidth") <= 390
    seen = tab.value(SEEN)
    assert min(seen[what][0] for what in ("ball", "cup", "arm")) > 60
    assert tab.value("getComputedStyle(document.querySelector('.replay canvas')).touchAction") == "pan-y"
    assert tab.said == []
    tab.send("Page.close")


def test_without_webgl_the_flat_replay_stands_there(tmp_path, monkeypatch, report) -> None:
    blind = (*chromium_module.OPTIONS, "--disable-webgl", "--disable-webgl2", "--force-prefers-reduced-motion")
    monkeypatch.setattr(chromium_module, "OPTIONS", blind)
    with browser(tmp_path) as chromium:
        tab = chromium.open(report.as_uri(), 1000, 800)
        tab.wait("document.readyState === 'complete'")
        assert tab.value("getComputedStyle(document.querySelector('.replay')).display") == "none"
        assert tab.value("document.querySelector('.flat .player svg').getBoundingClientRect().width") > 300
        before = tab.value("document.querySelector('.flat .ball').getAttribute('cx')")
        tab.value(
            "(() => { const one = document.querySelector('.flat input'); one.value = 3;"
            " one.dispatchEvent(new Event('input')); })()"
        )
        assert tab.value("document.querySelector('.flat .ball').getAttribute('cx')") != before
        assert tab.said == []
