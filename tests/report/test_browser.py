"""The report in a real browser: it renders, moves, reports no error and fits a phone."""

import base64
import hashlib
import json
import re
import shutil
import subprocess

import numpy as np
import pytest
from PIL import Image

from kendama_cli.report.sweep_page import make_sweep_report
from tests.report.synthetic_sweep import write_explorations, write_transfers

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(
    CHROMIUM is None, reason="needs the program chromium (Debian: apt-get install chromium)"
)

PROBE = """
<pre id="probe"></pre><script>
const errors = [];
addEventListener('error', event => errors.push(String(event.message)));
addEventListener('load', () => setTimeout(() => {
  const sizes = [...document.querySelectorAll('figure svg, .hero svg')].map(svg => svg.getBoundingClientRect());
  const players = [...document.querySelectorAll('.player')];
  const before = players.map(player => player.querySelector('.ball').getAttribute('cx'));
  for (const player of players) {
    const slider = player.querySelector('input');
    slider.value = 3; slider.dispatchEvent(new Event('input'));
  }
  document.getElementById('probe').textContent = JSON.stringify({
    errors, svgs: sizes.length, empty: sizes.filter(size => size.width < 100 || size.height < 40).length,
    moved: players.filter((player, n) => player.querySelector('.ball').getAttribute('cx') !== before[n]).length,
    players: players.length, wide: document.documentElement.scrollWidth, window: innerWidth,
    loaded: performance.getEntriesByType('resource').map(one => one.name).filter(name => !name.startsWith('data:')),
  });
}, 300));
</script>
"""


def _chromium(tmp_path, page, *options):
    """Run headless Chromium, without WebGL, with a profile of its own on ``page``; its standard output and error."""
    done = subprocess.run(
        [
            str(CHROMIUM),
            *(
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-3d-apis",
                "--disable-quic",
                "--no-first-run",
                "--hide-scrollbars",
            ),
            *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
            *("--force-prefers-reduced-motion", "--enable-logging=stderr", "--virtual-time-budget=4000"),
            f"--user-data-dir={tmp_path / 'profile'}",
            *options,
            page.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    return done.stdout, done.stderr


def _probed(page):
    """The page with the probe in it, which its policy is told to let run."""
    probe = PROBE.replace("\n", " ")
    script = re.search(r"<script>(.*?)</script>", probe)[1]
    allowed = f"script-src 'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
    policy = re.search(r"script-src '|style-src '", page)[0]
    page = page.replace(policy, f"{allowed} '" if policy.startswith("script") else f"{allowed}; {policy}", 1)
    return page.replace("<main>", probe + "<main>", 1)


@pytest.mark.parametrize("many", [pytest.param(False, marks=pytest.mark.slow), True])
def test_no_script_runs_that_is_not_the_pages_own(tmp_path, request, many):
    html = make_sweep_report("made up", write_explorations(tmp_path, 2)) if many else request.getfixturevalue("page")
    own = "<script>document.title='taken'</script><svg onload=\"document.title='taken'\"></svg>"
    own += "<img src='data:x' onerror=\"document.title='taken'\"><iframe src='data:text/html,x'></iframe>"
    page = tmp_path / "report.html"
    page.write_text(html.replace("<main>", own + "<main>", 1), encoding="utf-8")
    out, err = _chromium(tmp_path, page, "--dump-dom")
    assert "<title>kendama: " in out
    assert "<title>taken" not in out
    assert err.count("Content Security Policy") >= 3
    page.write_text(re.sub("<meta http-equiv=.Content-Security-Policy.[^>]*>", "", html).replace("<main>", own, 1))
    assert "<title>taken" in _chromium(tmp_path, page, "--dump-dom")[0], "the attack would do nothing anyway"


@pytest.mark.parametrize("width", [pytest.param(1200, marks=pytest.mark.slow), 500])
def test_the_page_renders_moves_and_loads_nothing(tmp_path, page, width):
    file = tmp_path / "report.html"
    file.write_text(_probed(page), encoding="utf-8")
    out, err = _chromium(tmp_path, file, "--dump-dom", f"--window-size={width},900")
    found = re.search(r'<pre id="probe">(.*?)</pre>', out)
    assert found is not None
    seen = json.loads(found[1].replace("&amp;", "&"))
    assert seen["errors"] == []
    assert "CONSOLE" not in err
    assert seen["svgs"] >= 25
    assert seen["empty"] == 0
    assert seen["moved"] == seen["players"] == 3
    assert seen["wide"] <= seen["window"]  # no sideways scrolling of the page
    assert seen["loaded"] == []


@pytest.mark.parametrize("width", [pytest.param(1200, marks=pytest.mark.slow), 500])
def test_the_page_over_many_runs_renders_and_fits(tmp_path, width):
    html = make_sweep_report("made up", [*write_explorations(tmp_path, 5), *write_transfers(tmp_path)])
    page = tmp_path / "report.html"
    page.write_text(_probed(html), encoding="utf-8")
    out, _ = _chromium(tmp_path, page, "--dump-dom", f"--window-size={width},900")
    found = re.search(r'<pre id="probe">(.*?)</pre>', out)
    assert found is not None
    seen = json.loads(found[1].replace("&amp;", "&"))
    assert seen["errors"] == []
    assert seen["svgs"] == 6
    assert seen["empty"] == 0
    assert seen["wide"] <= seen["window"]
    assert seen["loaded"] == []


def test_the_picture_shows_cup_blue_and_ball_vermilion(tmp_path, page):
    file = tmp_path / "report.html"
    file.write_text(page, encoding="utf-8")
    _chromium(tmp_path, file, f"--screenshot={tmp_path / 'page.png'}", "--window-size=1200,1000")
    with Image.open(tmp_path / "page.png") as opened:
        pixels = np.asarray(opened.convert("RGB")).astype(int)
    for colour in ((0x00, 0x72, 0xB2), (0xD5, 0x5E, 0x00)):
        assert (np.abs(pixels - colour).max(axis=-1) < 12).sum() > 200
