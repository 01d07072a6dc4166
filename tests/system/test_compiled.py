"""Compiled code has the plain law that it names, and never plays one that has changed since."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

LAW = """
SHARE = {share}

class Rope(NamedTuple):
    {first}: float
    {second}: float

def law(rope: Rope, x: float) -> float:
    return SHARE * _stretched(rope, x)

def _stretched(rope: Rope, x: float) -> float:
    return rope.length_m {sign} rope.width_m * x
"""
KERNEL = """
from kendama_cli.ropes_of_a_test import Rope, law
from kendama_cli.system.compiled import compiled

@compiled
def play(rope: Rope, x: float) -> float:
    return law(rope, x) + 1.0
"""
PROBE = """
import sys, kendama_cli
kendama_cli.__path__.append(sys.argv[1])
from kendama_cli.kernel_of_a_test import play
from kendama_cli.ropes_of_a_test import Rope, law
rope = Rope(length_m=5.0, width_m=7.0)
assert law(rope, 2.0) + 1.0 == play.py_func(rope, 2.0) == play(rope, 2.0)
print(play(rope, 2.0), sum(play.stats.cache_hits.values()))
"""
FIRST = {"share": "2.0", "first": "length_m", "second": "width_m", "sign": "+"}


def played(folder: Path, **changed: str) -> list[float]:
    """What compiled code gives in a new process, and how often it came out of numba's cache."""
    law = "from __future__ import annotations\nfrom typing import NamedTuple\n" + LAW.format(**FIRST | changed)
    (folder / "ropes_of_a_test.py").write_text(law)
    (folder / "kernel_of_a_test.py").write_text("from __future__ import annotations\n" + KERNEL)
    done = subprocess.run([sys.executable, "-c", PROBE, str(folder)], capture_output=True, text=True, check=True)
    return [float(part) for part in done.stdout.split()]


def test_a_kernel_has_the_law_of_another_file_as_it_stands_there_now(tmp_path: Path) -> None:
    assert played(tmp_path) == [39.0, 0]
    assert played(tmp_path) == [39.0, 1]
    assert played(tmp_path, sign="-") == [-17.0, 0]
    assert played(tmp_path, share="3.0") == [58.0, 0]
    assert played(tmp_path, first="width_m", second="length_m") == [39.0, 0]


def test_a_kernel_stands_below_what_it_calls(tmp_path: Path) -> None:
    (tmp_path / "kernel.py").write_text(
        "from kendama_cli.system.compiled import compiled\n\n\n@compiled\ndef play(x):\n    return late(x)\n\n\n"
        "def late(x):\n    return x\n"
    )
    done = subprocess.run([sys.executable, "kernel.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stderr.endswith("NameError: __main__.play stands above 'late', which it uses\n")
