"""A phone's page in Chromium under the samples of a recording, and the game that it joins."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np

COMMAND = [sys.executable, "-m", "kendama_cli.cli.main", "play", "--phone", "--no-show"]
REPLAY = """
window.replay = rows => new Promise(done => {
  const began = performance.now(), first = rows[0][0];
  let k = 0;
  const step = () => {
    const now = performance.now() - began;
    while (k < rows.length && rows[k][0] - first <= now) {
      const [t, x, y, z, alpha, beta, gamma] = rows[k++];
      const event = new DeviceMotionEvent('devicemotion',
        {accelerationIncludingGravity: {x, y, z}, rotationRate: {alpha, beta, gamma}, interval: 16});
      Object.defineProperty(event, 'timeStamp', {value: began + t - first});
      dispatchEvent(event);
    }
    if (k < rows.length) setTimeout(step, 4); else done(k);
  };
  step();
});
"""
SHAKEN = "window.shaken = []; navigator.vibrate = how => { shaken.push(how); return true; };"


class PhoneGame:
    """A running ``kendama play --phone``: the page's address, the phones', and what it has said."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.folder, self.said = folder, list[str]()
        self.process = subprocess.Popen(
            [*COMMAND, *options], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().strip()
        threading.Thread(target=self._read, daemon=True).start()
        until_s = time.monotonic() + 30
        while not (found := re.search(r"phones join at (https://\S+)", "\n".join(self.said))):
            assert time.monotonic() < until_s, self.said
            time.sleep(0.05)
        self.joining = found[1]

    def _read(self) -> None:
        assert self.process.stderr is not None
        self.said.extend(line.rstrip() for line in self.process.stderr)

    def end(self) -> int:
        """End it as Ctrl-C does; its exit code."""
        self.process.send_signal(2)
        return self.process.wait(timeout=30)


def opened_phone(chromium, game, player: str, *before: str):
    """Open the phone's page, at a phone's size; the certificate is accepted as a player does."""
    tab = chromium.open("about:blank", 390, 844, phone=True)
    tab.wait("document.readyState === 'complete'")
    time.sleep(0.3)  # the empty page is replaced by itself
    tab("Security.setIgnoreCertificateErrors", ignore=True)
    for script in (SHAKEN, *before):
        tab("Page.addScriptToEvaluateOnNewDocument", source=script)
    tab("Page.navigate", url=f"{game.joining}&player={player}")
    tab.wait("window.kendama !== undefined", timeout_s=30.0)
    tab.value(REPLAY)
    return tab


def rows_of(t_s, force, rate, sign: float = 1.0) -> str:
    """Return samples as a browser gives them: ms, m/s^2 and deg/s."""
    return json.dumps(np.column_stack([1e3 * t_s, sign * force, np.degrees(rate)]).round(5).tolist())
