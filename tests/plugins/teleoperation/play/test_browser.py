"""The page in Chromium, under real pointer events: what is dragged arrives, is drawn, and fits a phone."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.plugins.teleoperation.play.conditions import Conditions
from kendama_cli.plugins.teleoperation.play.tries import Try, TryFolder
from tests.chromium import CHROMIUM, browser
from tests.plugins.teleoperation.play.table_top import caught_swing, hand

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(CHROMIUM is None, reason="needs the program chromium (Debian: apt-get install chromium)"),
]
LISTEN = """
window.dragged = [];
document.getElementById('view').addEventListener('pointerrawupdate', event => {
  for (const one of event.getCoalescedEvents()) dragged.push([one.timeStamp, one.clientX, one.clientY]);
});
"""
PAD = """
window.shaken = [];
window.pad = {axes: [0, 0, 0, 0], buttons: [{pressed: false}],
  vibrationActuator: {playEffect: (kind, how) => shaken.push(how.weakMagnitude)}};
navigator.getGamepads = () => [pad];
"""


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("profile")) as made:
        yield made


@contextlib.contextmanager
def opened(chromium, game, player, *size, phone=False):
    tab = chromium.open(f"{game.address}&player={player}", *size, phone=phone)
    tab.wait("window.kendama && document.getElementById('folder').textContent")
    yield tab
    tab.send("Page.close")  # what is open goes on drawing


def drag(tab, at=(450.0, 450.0), touch=False, shown="kendama.tries.length > 0"):
    """The bundled swing as a drag in real time, and what was asked for: times [s], aside and up [m]."""
    metre = tab.value("kendama.metre")
    samples = hand(caught_swing()[0], wait_s=0.4)
    began = time.time()
    for k, one in enumerate(samples):
        after_s = one.t_s - samples[0].t_s
        time.sleep(max(0.0, began + after_s - time.time()))
        x, y = at[0] + one.aside_m * metre, at[1] - one.up_m * metre
        if touch:
            kind = "touchMove" if k else "touchStart"
            tab.send("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": x, "y": y}], timestamp=began + after_s)
        else:
            kind = "mouseMoved" if k else "mousePressed"
            tab.send(
                "Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, timestamp=began + after_s
            )
    if touch:
        tab("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    else:
        tab("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, button="left", buttons=0)
    tab.wait(shown)
    rows = [(one.t_s - samples[0].t_s, one.aside_m, one.up_m) for one in samples]
    return np.array(rows), metre


def recorded(game: Path, player: str):
    (file,) = (game / "plays" / player).glob("*.csv")
    rows = np.loadtxt(file, delimiter=",", skiprows=8)
    return rows[:, 0], rows[:, (1, 3)]


def distance(t_s, places, dragged, shift_s):
    """How far a demonstration that begins ``shift_s`` into the drag is from it, where every moment is free by 2 ms."""
    error = np.full(len(t_s), np.inf)
    for late_s in np.linspace(-0.002, 0.002, 9):
        asked = np.column_stack([np.interp(t_s + shift_s + late_s, dragged[:, 0], dragged[:, c]) for c in (1, 2)])
        error = np.minimum(error, np.linalg.norm(places - asked, axis=1))
    return float(error.max())


def farthest(t_s, places, dragged):
    """How far a demonstration is from what was dragged, where its begin is free; it may end after it, at rest."""
    begins = np.arange(0.0, dragged[-1, 0], 0.01)
    near = begins[np.argmin([distance(t_s, places, dragged, begin) for begin in begins])]
    return min(distance(t_s, places, dragged, near + fine) for fine in np.arange(-0.01, 0.01, 0.001))


def test_a_dragged_swing_arrives_within_a_millimetre_and_two_milliseconds(chromium, game):
    with opened(chromium, game, "mouse") as tab:
        tab.value(LISTEN)
        asked, metre = drag(tab)
        events = np.array(tab.value("dragged"))
        felt = np.column_stack(
            [(events[:, 0] - events[0, 0]) / 1e3, (events[:, 1] - 450) / metre, (450 - events[:, 2]) / metre]
        )
        t_s, places = recorded(game.folder, "mouse")
        assert len(events) > 0.9 * len(asked)  # nothing was coalesced away
        assert farthest(t_s, places, felt) < 1e-3
        assert farthest(t_s, places, asked) < 1e-3
        assert tab.value("document.querySelector('#tries li').className") in ("caught", "missed")
        assert tab.said == []


def test_the_page_fits_a_phone_and_a_finger_drags(chromium, game):
    with opened(chromium, game, "finger", 390, 844, phone=True) as tab:
        drag(tab, (195.0, 420.0), touch=True)
        t_s, _ = recorded(game.folder, "finger")
        assert t_s[-1] > 1
        assert tab.value("document.documentElement.scrollWidth") <= 390
        assert tab.value("document.getElementById('stage').getBoundingClientRect().height") > 400
        assert tab.said == []


def test_a_gamepad_drags_the_cup_and_shakes_with_the_rope(chromium, game):
    with opened(chromium, game, "pad") as tab:
        tab.value(PAD)
        tab.value("pad.buttons[0].pressed = true")
        tab.wait("kendama.state && kendama.state.phase === 'playing'")
        for k in range(40):
            tab.value(f"pad.axes = [{np.sin(0.35 * k):.4f}, {-0.3 * np.sin(0.35 * k):.4f}, 0.5, 0]")
            time.sleep(0.02)
        assert tab.value("Math.abs(kendama.state.cup[2])") > 0.05
        tab.value("pad.buttons[0].pressed = false")
        tab.wait("kendama.tries.length > 0")
        shaken = tab.value("shaken")
        assert min(shaken) > 0
        assert np.ptp(shaken) > 0.1  # the rope's pull varies as the ball swings


def test_a_try_is_shown_renamed_and_deleted_on_the_page(chromium, game):
    with opened(chromium, game, "list") as tab:
        drag(tab)
        tab.value("document.querySelector('#tries .name').click()")
        tab.wait("!document.getElementById('replay').hidden")
        tab.value("document.getElementById('stop').click()")
        tab.value("setTimeout(() => document.querySelector('#tries [title^=Give]').click())")
        tab.wait("kendama.tries[0].name === 'list-a-name'")
        tab.value("setTimeout(() => document.querySelector('#tries [title^=Delete]').click())")
        tab.wait("kendama.tries.length === 0")
        assert tab.value("document.getElementById('none').hidden") is False


SHOWN_WHOLE = """
[...document.querySelectorAll('#tries .about')].every(one => one.scrollWidth <= one.clientWidth
  && one.getBoundingClientRect().right <= innerWidth && getComputedStyle(one).textOverflow !== 'ellipsis')
"""


def test_each_state_is_shown_whole_and_why_a_try_was_interrupted(chromium, game, tmp_path):
    conditions = Conditions(0.4, 0.7, 1.6).words()
    reason = "nothing was heard of the hand for 0.31 s, while this computer was busy with something else"
    doubt = "line 99: the position jumps by 0.3 m within 0.004 s"
    folder = TryFolder(game.folder / "plays", "whole", 9, lambda _: doubt)
    for outcome, note in (("interrupted", reason), ("caught", "")):
        folder.keep(Try("", outcome, False, "2026-05-04T03:02:01.000+00:00", 2.3, conditions, note), caught_swing()[1])
    with opened(chromium, game, "whole", 1280, 720) as tab:
        tab.wait("kendama.tries.length === 2")
        said = tab.value("[...document.querySelectorAll('#tries .about')].map(one => one.innerText)")
        eased = conditions.partition(";")[0]
        assert said == [
            f"caught, 2.3 s, {eased}; not for the robot: {doubt}",
            f"interrupted, 2.3 s, {eased}; {reason}",
        ]
        assert tab.value(SHOWN_WHOLE)
        tab.picture(tmp_path / "whole.png")


def test_a_try_that_cannot_be_written_is_told(chromium, game):
    (game.folder / "plays" / "full").write_text("in the way")
    with opened(chromium, game, "full", 1280, 720) as tab:
        tab.wait("document.getElementById('problem').innerText.includes('tries cannot be kept in')")
        drag(tab, shown="document.getElementById('problem').innerText.includes('could not be kept')")


def test_a_second_window_takes_over_and_the_first_says_so(chromium, game):
    with opened(chromium, game, "twice") as first:
        with opened(chromium, game, "twice"):
            said = first.wait(
                "!document.getElementById('problem').hidden && document.getElementById('problem').innerText"
            )
        assert "'twice' plays in another window now" in said
