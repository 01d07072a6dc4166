"""The phone's page in Chromium: a recording replayed as motion events, the laptop's page, and the kept try."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from kendama_cli.plugins.teleoperation.play.tries import read_try
from tests.chromium import CHROMIUM, browser
from tests.plugins.phone.phones import UPRIGHT, bundled_swing, rms_m, take
from tests.plugins.phone.replayed import opened_phone, rows_of

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(CHROMIUM is None, reason="needs the program chromium (Debian: apt-get install chromium)"),
]


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("profile")) as made:
        yield made


def swung(seed: int = 2, **how):
    """A simulated phone at a browser's rate, held as the page asks."""
    rests_s = {"rate_hz": 60.0, "rests_s": (1.5, 2.5), "lean_deg": 15.0, "held": UPRIGHT}
    return take(np.random.default_rng(seed), bundled_swing(4), **{**rests_s, **how})


def played(tab, one, sign=1.0):
    """Press Start and replay a recording."""
    tab.value("document.getElementById('start').click()")
    tab.wait("!document.getElementById('play').hidden")
    tab.value(f"replay({rows_of(one.t_s, one.force, one.rate, sign)}).then(k => window.done = k); 0")


def test_a_swing_is_drawn_on_the_laptop_and_kept_as_it_was_got_back(chromium, game, tmp_path):
    laptop = chromium.open(f"{game.address}&player=anna")
    laptop.wait("document.getElementById('code')?.naturalWidth > 0")
    laptop.picture(tmp_path / "invited.png")
    phone = opened_phone(chromium, game, "anna")
    phone.picture(tmp_path / "start.png")
    one = swung()
    played(phone, one)
    laptop.wait("!document.getElementById('joined').hidden && kendama.state && kendama.state.phase === 'playing'")
    laptop.wait("Math.abs(kendama.state.cup[0]) > 0.1")
    laptop.picture(tmp_path / "laptop.png")
    phone.picture(tmp_path / "swung.png")
    laptop.wait("kendama.tries.length === 1")
    phone.wait("window.done")
    phone.wait("shaken.length > 0")
    (file,) = (game.folder / "plays" / "anna").glob("*.csv")
    rows = np.loadtxt(file, delimiter=",", skiprows=8)
    assert read_try(file).outcome in ("caught", "missed")
    true = CubicSpline(one.true_s, one.true_m)
    # the kept path begins at some moment of the rest before: where it fits best
    shifts = np.arange(0.0, 2.5, 0.02)
    near = [rms_m(rows[:, 1:4], true(np.clip(rows[:, 0] + shift, 0, one.true_s[-1]))) for shift in shifts]
    assert min(near) < 0.015
    assert phone.value("document.documentElement.scrollWidth") <= 390
    assert phone.said == laptop.said == []
    assert any("neither is a bound" in line for line in game.said)
    drawn_ms = laptop.value("kendama.latencies")
    assert min(drawn_ms) > 7  # not sooner than smoothing allows
    middle, late = np.quantile(drawn_ms, [0.5, 0.95])
    print(f"\n{len(drawn_ms)} drawn, sample to ball p50 {middle:.0f}, p95 {late:.0f} ms")
    phone.send("Page.close")
    laptop.send("Page.close")


APPLE = "Object.defineProperty(navigator, 'vendor', {get: () => 'Apple Computer, Inc.'});"


@pytest.mark.parametrize(
    ("vendor", "sign", "line"),
    [
        (APPLE, -1.0, "Ready: swing"),
        ("", 1.0, "Ready: swing"),
        ("", -1.0, "The top edge points down"),
    ],
)
def test_accelerations_of_the_other_sign_are_turned_or_told(chromium, game, vendor, sign, line):
    phone = opened_phone(chromium, game, "sign", vendor)
    one = swung(rests_s=(4.0, 0.5))
    still = one.t_s < 3.9
    played(
        phone,
        type(one)(one.t_s[still], one.force[still], one.rate[still], one.true_s, one.true_m, one.true_rotation),
        sign,
    )
    phone.wait(f"kendama.hint.startsWith({json.dumps(line)})")
    assert phone.value("document.getElementById('turned').hidden") is (line != "The top edge points down")
    phone.send("Page.close")


@pytest.mark.parametrize(
    ("before", "press", "line"),
    [
        ("delete window.DeviceMotionEvent;", False, "no motion sensors"),
        ("Object.defineProperty(window, 'isSecureContext', {get: () => false});", False, "Without HTTPS"),
        ("DeviceMotionEvent.requestPermission = async () => 'denied';", True, "denied"),
        ("", True, "No sample has come"),
    ],
)
def test_what_lacks_is_one_line_on_the_phone(chromium, game, before, press, line):
    phone = opened_phone(chromium, game, "lacks", before)
    if press:
        phone.value("document.getElementById('start').click()")
    phone.wait(f"document.getElementById('problem').innerText.includes({json.dumps(line)})")
    phone.send("Page.close")


def test_a_phone_in_the_background_or_without_gyroscope_says_so(chromium, game):
    phone = opened_phone(chromium, game, "hidden", "DeviceMotionEvent.requestPermission = async () => 'granted';")
    phone.value("document.getElementById('start').click()")
    phone.wait("!document.getElementById('play').hidden")
    phone.value(
        "dispatchEvent(new DeviceMotionEvent('devicemotion', {accelerationIncludingGravity: {x: 0, y: 9.8, z: 0}}))"
    )
    phone.wait("document.getElementById('problem').innerText.includes('no gyroscope')")
    phone.value("Object.defineProperty(document, 'hidden', {get: () => true})")
    phone.value("document.dispatchEvent(new Event('visibilitychange'))")
    phone.wait("document.getElementById('problem').innerText.includes('In the background')")
    phone.send("Page.close")


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_try_of_the_phone_teaches_an_arm_to_catch(chromium, game):
    phone = opened_phone(chromium, game, "arm")
    played(phone, swung(3))
    phone.wait("window.done")
    folder = game.folder / "plays" / "arm"
    phone.wait("document.getElementById('result').textContent")
    files = sorted(folder.glob("*.csv"))
    assert len(files) == 1
    overrides = [f"capture.path={files[0]}", "capture.take=all", "adapt.repeats=5"]
    command = [sys.executable, "-m", "kendama_cli.cli.main", "run", "-p", "imitation", "--json", "capture=play"]
    done = subprocess.run([*command, *overrides], cwd=game.folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    metrics = {stage["name"]: stage["metrics"] for stage in json.loads(done.stdout)["stages"]}
    assert metrics["adapt"]["caught"] is True
