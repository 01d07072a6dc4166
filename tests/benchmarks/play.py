"""Time from the hand to the drawn ball, and simulation of every millisecond of several players in time.

``python -m tests.benchmarks.play [SECONDS [PLAYERS]]`` starts ``kendama play``, one Chromium and further players that
only speak the page's language; all swing without end. Without Chromium the first line is left out.
"""

from __future__ import annotations

import json
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from tests.chromium import CHROMIUM, Tab, browser
from tests.plugins.teleoperation.play.served_game import Game
from tests.plugins.teleoperation.play.table_top import hand

RATE_HZ = 125.0


def player(game: Game, name: str, until_s: float, found: list[tuple[int, float, list[float]]]) -> None:
    """Swing until then; adds the steps simulated, the time that the hand said, and how long each answer took [ms]."""
    samples, took_ms = hand(), []
    with game.line(name) as line:
        line.hear("tries")
        zero_s, k = time.monotonic(), 0
        while (now_s := time.monotonic()) < until_s:
            one = samples[k % len(samples)]
            t_s = now_s - zero_s
            line.say(type="hand", samples=[[1000 * t_s, one.aside_m, one.up_m, 0.0]], held=True)
            state = line.hear("state")
            took_ms.append(1000 * (time.monotonic() - now_s))
            k += 1
            time.sleep(max(0.0, zero_s + k / RATE_HZ - time.monotonic()))
    found.append((state["steps"], t_s, took_ms))


def drag(tab: Tab, until_s: float) -> list[float]:
    """The bundled swing again and again, by real pointer events; how long each sample took to be drawn [ms]."""
    metre, samples, took_ms = tab.value("kendama.metre"), hand(), list[float]()
    while time.monotonic() < until_s:
        began = time.monotonic()
        for k, one in enumerate(samples):
            time.sleep(max(0.0, began + one.t_s - samples[0].t_s - time.monotonic()))
            kind = "mouseMoved" if k else "mousePressed"
            x, y = 450 + one.aside_m * metre, 450 - one.up_m * metre
            tab.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1)
        tab("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, button="left", buttons=0)
        time.sleep(1.5)
        took_ms += tab.value("kendama.latencies.splice(0)")  # the page keeps the newest ones only
    return took_ms


def main(seconds: float, players: int) -> None:
    """Print name, value and unit."""
    with tempfile.TemporaryDirectory() as folder:
        # a hand that never lets go has one long try
        game = Game(Path(folder), "play.max_attempt_s=100000")
        found: list[tuple[int, float, list[float]]] = []
        try:
            until_s = time.monotonic() + seconds
            others = [
                threading.Thread(target=player, args=(game, f"player-{k}", until_s, found)) for k in range(players - 1)
            ]
            for one in others:
                one.start()
            if CHROMIUM is not None:
                with browser(Path(folder) / "profile") as chromium:
                    tab = chromium.open(f"{game.address}&player=seen")
                    tab.wait("window.kendama && document.getElementById('folder').textContent")
                    ms = np.array(drag(tab, until_s))
                if len(ms):
                    middle, late = np.quantile(ms, (0.5, 0.95))
                    print(f"hand to drawn ball: median {middle:.1f}, 95 % {late:.1f} ms ({len(ms)} samples)")
            for one in others:
                one.join()
        finally:
            game.end()
        for steps, t_s, took in found:
            print(
                f"steps / milliseconds of the hand: {steps} / {1000 * t_s:.0f}; answer median {np.median(took):.1f}, "
                f"99 % {np.quantile(took, 0.99):.1f}, longest {max(took):.0f} ms"
            )
        print(json.dumps({"lines": game.said[-3:]}))


if __name__ == "__main__":
    main(*(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0, int(sys.argv[2]) if len(sys.argv) > 2 else 4))
