"""The page that blinks, in a real browser: it tells when it switched, often enough and in no rhythm."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.cli.main import main
from tests.chromium import CHROMIUM, browser

pytestmark = pytest.mark.skipif(
    CHROMIUM is None, reason="needs the program chromium (Debian: apt-get install chromium)"
)


def test_the_page_tells_when_its_light_switched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["camera", "blink"]) == 0
    began_s = time.time()
    with browser(tmp_path / "profile") as chromium:
        tab = chromium.open((tmp_path / "blink.html").as_uri() + "?seconds=4")
        told = tab.wait("document.getElementById('switches')?.textContent", 60.0)
        assert tab.value("document.querySelector('a').download") == "blinks.csv"
        assert tab.said == []
    head, *rows = told.split()
    times_s = np.array([float(row) for row in rows])
    assert head == "t_s"
    assert began_s - 0.05 < times_s[0] < times_s[-1] < time.time() + 0.05, "Unix time"
    assert np.diff(times_s).min() >= 0.06
    assert len(times_s) >= 5
