"""kendama camera track without boxes: somebody at a terminal draws them on the page, and the command goes on."""

import csv
import json
import os
import pty
import subprocess
import sys

import numpy as np
import pytest

from tests.vision.ball_films import pendulum, textured, write_film

BROWSER = """#!{python}
import json, sys, time
from urllib.request import urlopen

def ask(part, sent=None):
    body = None if sent is None else json.dumps(sent).encode()
    return json.load(urlopen(sys.argv[1].replace("/?", "/" + part + "?"), body, timeout=60))

places = json.load(open({truth!r}))
for frame in ask("state")["offered"][:5]:
    u, v = places[frame]
    ask("box", {{"frame": frame, "box": [u - 6.5, v - 6.5, 14, 14]}})
while ask("state")["missing"]:
    time.sleep(0.2)
ask("done", {{}})
"""
"""A browser with a hand that draws five boxes and presses Done."""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_boxes_drawn_on_the_page_are_tracked_at_once(here):
    frames, truth = pendulum(60, 10010, background=textured(10011))
    write_film(here / "swing.avi", frames)
    (here / "truth.json").write_text(json.dumps(truth.tolist()))
    (here / "hand").write_text(BROWSER.format(python=sys.executable, truth=str(here / "truth.json")))
    (here / "hand").chmod(0o755)
    host, terminal = pty.openpty()
    words = ["camera", "track", "swing.avi", "-o", "swing.csv", "--json"]
    done = subprocess.run(
        [sys.executable, "-m", "kendama_cli.cli.main", *words],
        env=os.environ | {"BROWSER": str(here / "hand")},
        stdin=terminal,
        stdout=subprocess.PIPE,
        stderr=terminal,
        timeout=600,
        check=False,
    )
    os.close(terminal)
    told = os.read(host, 100_000).decode()
    os.close(host)
    assert done.returncode == 0, told
    assert "swing-boxes: 5 boxes" in told
    with (here / "swing.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert json.loads(done.stdout)["rows"] == len(rows) >= 0.9 * len(frames)  # nothing but the document on stdout
    off = [np.hypot(float(r["u_px"]) - u, float(r["v_px"]) - v) for r in rows for u, v in [truth[int(r["frame"])]]]
    assert np.mean(np.array(off) < 7) >= 0.95
