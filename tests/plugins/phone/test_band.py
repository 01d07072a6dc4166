"""The likely error of a phone's swing: in the metrics of its capture, and as a band in the report."""

from __future__ import annotations

import json
import os
import re

import numpy as np

from tests import warm_command
from tests.plugins.phone.phones import bundled_swing, take, write_phyphox


def reported(folder, *overrides):
    """Run capture alone; return its metrics and the page of its report."""
    words = ("run", "-p", "imitation", "--until", "capture", "--json", *overrides)
    done, drawn = (
        warm_command.kendama(one, folder, os.environ, 240, libraries=True)
        for one in (words, ("report", "-o", "page.html"))
    )
    assert done.returncode == drawn.returncode == 0, done.stderr + drawn.stderr
    return json.loads(done.stdout)["stages"][0]["metrics"], (folder / "page.html").read_text()


def test_the_report_draws_the_likely_error_of_a_phones_swing_and_of_no_other(tmp_path):
    one = take(np.random.default_rng(11), bundled_swing(1), lean_deg=15.0)
    write_phyphox(tmp_path / "swing.zip", one.t_s, one.force, one.rate)
    metrics, page = reported(tmp_path, "capture=phone", "capture.path=swing.zip")
    told = re.search(r"The band is (\d+)\s+mm wide to each side", page)
    assert int(told[1]) == round(metrics["likely_error_mm"])
    other, page = reported(tmp_path)
    assert "likely_error_mm" not in other
    assert "The band is" not in page
