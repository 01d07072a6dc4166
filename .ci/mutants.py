"""Mutants of the numerics that the tests let live.

    python .ci/mutants.py --sample 100 --seed 1 [FOLDER ...]

Each mutant is one changed operator, comparison, sign or number in a copy of the tree; the test files that import its
module run until one fails. Prints every survivor and the share killed with its 95 % interval. A survivor that changes
no result (a tolerance, a starting value, the order of equal things) is no fault of the tests: look at each.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from scipy.stats import binomtest

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = [
    "physics",
    "motion",
    "learning",
    "robot_model",
    "identification",
    "adaptation",
    "control",
    "simulation",
    "vision",
]
SWAPS = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.Pow: "*", ast.Mod: "*", ast.FloorDiv: "*"}
TURNED = {ast.Lt: ">=", ast.LtE: "<", ast.Gt: "<=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "==", ast.IsNot: "is"}
MOST_TEST_FILES = 12
TIMEOUT_S = 1800
SLOWER = 4
"""A mutant whose tests take so many times as long as without it is killed."""


@dataclass(frozen=True)
class Mutant:
    """A changed piece of a module: ``new`` in the place of characters ``start`` to ``end``."""

    module: Path
    line: int
    start: int
    end: int
    new: str

    def __str__(self) -> str:
        old = self.module.read_text()[self.start : self.end]
        return f"{self.module.relative_to(ROOT)}:{self.line}: {old} -> {self.new}"


def mutants(module: Path) -> Iterator[Mutant]:
    """Yield every mutant of a module; texts, defaults of declarations and type hints are left as they are."""
    text = module.read_text()
    if not text.isascii():  # places in the tree count bytes
        return
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))

    def place(node: ast.expr) -> tuple[int, int]:
        end = starts[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0)
        return starts[node.lineno - 1] + node.col_offset, end

    functions = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
    for node in {inner for function in functions for part in function.body for inner in ast.walk(part)}:
        if isinstance(node, ast.BinOp) and type(node.op) in SWAPS:
            (_, left), (right, _) = place(node.left), place(node.right)
            old = text[left:right]
            sign = {ast.Pow: "**", ast.FloorDiv: "//"}.get(type(node.op), old.strip("() \n")[:1])
            if old.count(sign) == 1:
                at = left + old.index(sign)
                yield Mutant(module, node.lineno, at, at + len(sign), SWAPS[type(node.op)])
        elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in TURNED:
            (_, left), (right, _) = place(node.left), place(node.comparators[0])
            if not set(text[left:right]) & set("()\n"):
                yield Mutant(module, node.lineno, left, right, f" {TURNED[type(node.ops[0])]} ")
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            start, _ = place(node)
            yield Mutant(module, node.lineno, start, start + 1, "+")
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            yield Mutant(module, node.lineno, *place(node), "1" if node.value == 0 else f"({node.value!r} * 2)")


def tests_of(module: Path) -> list[str]:
    """Return the test files that import ``module``: its own first, then those with the fewest other imports."""
    name = ".".join(module.relative_to(ROOT).with_suffix("").parts)
    own, others = [], []
    for file in sorted((ROOT / "tests").rglob("test_*.py")):
        text = file.read_text()
        if file.stem == f"test_{module.stem}":
            own.append(file)
        elif f"{name} import" in text or f"from {name.rpartition('.')[0]} import {module.stem}" in text:
            others.append(file)
    others.sort(key=lambda file: file.read_text().count("from kendama_cli"))
    return [str(file.relative_to(ROOT)) for file in (own + others)[:MOST_TEST_FILES]]


def run_tests(module: Path, tree: Path, home: Path, timeout_s: float) -> bool:
    """Return True if all tests of ``module`` pass in ``tree`` within the time."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", *tests_of(module)]
    places = {"PYTHONPATH": str(tree), "NUMBA_CACHE_DIR": str(home), "KENDAMA_HOME": str(home / "home")}
    try:
        done = subprocess.run(
            command, cwd=tree, env=os.environ | places, capture_output=True, timeout=timeout_s, check=False
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def lives(mutant: Mutant, tree: Path, home: Path, timeout_s: float) -> bool:
    """Return True if all tests of its module pass with the mutant in ``tree``."""
    file = tree / mutant.module.relative_to(ROOT)
    text = file.read_text()
    file.write_text(text[: mutant.start] + mutant.new + text[mutant.end :])
    try:
        return run_tests(mutant.module, tree, home, timeout_s)
    finally:
        file.write_text(text)


def main() -> None:
    """Draw a sample of mutants, run them, and print the survivors."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", default=FOLDERS)
    parser.add_argument("--sample", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    modules = [file for folder in asked.folders for file in sorted((ROOT / "kendama_cli" / folder).rglob("*.py"))]
    every = [mutant for module in modules if tests_of(module) for mutant in mutants(module)]
    drawn = random.Random(asked.seed).sample(sorted(every, key=str), min(asked.sample, len(every)))
    killed, tried, timeouts_s = 0, 0, {}
    with tempfile.TemporaryDirectory() as work:
        tree = Path(work, "kendama")
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(".git", "__pycache__", ".*_cache"))
        for mutant in drawn:
            module = mutant.module
            if module not in timeouts_s:  # tests that fail or are slow without a mutant say nothing about one
                started_s = time.monotonic()
                passed = run_tests(module, tree, Path(work), TIMEOUT_S)
                timeouts_s[module] = SLOWER * (time.monotonic() - started_s) + 60.0 if passed else None
            if timeouts_s[module] is None:
                print(f"not tried, its tests fail as they are: {mutant}", flush=True)
                continue
            tried += 1
            if lives(mutant, tree, Path(work), timeouts_s[module]):
                print(f"lives: {mutant}", flush=True)
            else:
                killed += 1
            print(f"{killed} of {tried} killed", flush=True)
    interval = binomtest(killed, tried).proportion_ci(method="wilson")
    share = f"{killed / tried:.0%} [{interval.low:.0%}, {interval.high:.0%}]"
    print(f"killed {killed} of {tried} ({share}), of {len(every)} mutants in all")


if __name__ == "__main__":
    main()
