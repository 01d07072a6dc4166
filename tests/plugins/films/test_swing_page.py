"""kendama camera train --cup: two pages, for the ball and for the cup, and boxes that capture=video finds."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from kendama_cli.plugins.films.swing_boxes import box_files
from tests.vision.ball_films import draw_ball, textured, write_film

BROWSER = """#!{python}
import json, sys, time
from urllib.request import urlopen

def get(part, sent=None):
    body = None if sent is None else json.dumps(sent).encode()
    return urlopen(sys.argv[1].replace("/?", "/" + part + "?"), body, timeout=60).read()

state = json.loads(get("state"))
thing = "cup" if state["folder"].endswith("cup") else "ball"
assert ("No " + thing).encode() in get("") and b"about the " + thing.encode() in get("")
places = json.load(open({truth!r}))[thing]
for frame in state["offered"][:5]:
    u, v = places[frame]
    get("box", {{"frame": frame, "box": [u - 8.5, v - 8.5, 18, 18]}})
while json.loads(get("state"))["missing"]:
    time.sleep(0.2)
get("done", {{}})
"""
"""A browser with a hand that draws five boxes on each page and presses Done."""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs a program as browser")
def test_ball_and_cup_are_boxed_one_after_the_other(here):
    turn = np.linspace(0, 6, 40)
    truth = {
        "ball": np.column_stack([160 + 60 * np.sin(turn), 150 + 20 * np.cos(turn)]),
        "cup": np.column_stack([160 + 40 * np.cos(turn), 60 + 20 * np.sin(turn)]),
    }
    frames = []
    for ball, cup in zip(*truth.values(), strict=True):
        image = textured(10011).copy()
        draw_ball(image, ball, 8.0, (40, 45, 50))
        draw_ball(image, cup, 8.0, (60, 60, 220), stripe=(220, 220, 40))
        frames.append(image)
    write_film(here / "swing.avi", frames)
    (here / "truth.json").write_text(json.dumps({thing: places.tolist() for thing, places in truth.items()}))
    (here / "hand").write_text(BROWSER.format(python=sys.executable, truth=str(here / "truth.json")))
    (here / "hand").chmod(0o755)
    done = subprocess.run(
        [sys.executable, "-m", "kendama_cli.cli.main", "camera", "train", "swing.avi", "--cup"],
        env=os.environ | {"BROWSER": str(here / "hand")},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "swing-boxes: 5 boxes" in done.stdout
    assert "swing-boxes/cup: 5 boxes" in done.stdout
    assert "kendama run -p imitation capture=video capture.path=swing.avi" in done.stdout
    assert len(box_files(here / "swing.avi")) == 20
