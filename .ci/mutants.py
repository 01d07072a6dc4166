"""Mutants of the numerics that the tests let live.

    python .ci/mutants.py --sample 100 --seed 1 [--work FOLDER] [FOLDER ...]

Each mutant is one changed operator, comparison, sign or number in a copy of the tree; the test files that import its
module run until one fails, which must pass without it, with bounds of arrays checked. Prints every survivor and the
share killed with its 95 % interval. With ``--work`` the copy and the results stay there: the same command goes on,
another seed adds to them. A survivor that changes no result (a tolerance, the order of equal things) is no fault.
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
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from scipy.stats import binomtest

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = [
    "physics", "motion", "learning", "robot_model", "identification", "adaptation", "control", "simulation", "vision",
]  # fmt: skip
SWAPS = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.Pow: "*", ast.Mod: "*", ast.FloorDiv: "*"}
TURNED = {ast.Lt: ">=", ast.LtE: "<", ast.Gt: "<=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "==", ast.IsNot: "is"}
TIMEOUT_S = 900  # a mutant whose tests do not end within it, as they do without it, is killed


@dataclass(frozen=True)
class Mutant:
    """A changed piece of a module: ``new`` in the place of characters ``start`` to ``end``."""

    module: Path
    start: int
    end: int
    new: str

    def __str__(self) -> str:
        text = self.module.read_text()
        line, column = text.count("\n", 0, self.start) + 1, self.start - text.rfind("\n", 0, self.start)
        return f"{self.module.relative_to(ROOT)}:{line}:{column}: {text[self.start : self.end]} -> {self.new}"


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
                yield Mutant(module, at, at + len(sign), SWAPS[type(node.op)])
        elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in TURNED:
            (_, left), (right, _) = place(node.left), place(node.comparators[0])
            if not set(text[left:right]) & set("()\n"):
                yield Mutant(module, left, right, f" {TURNED[type(node.ops[0])]} ")
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            start, _ = place(node)
            yield Mutant(module, start, start + 1, "+")
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            yield Mutant(module, *place(node), "1" if node.value == 0 else f"({node.value!r} * 2)")


def tests_of(module: Path) -> list[str]:
    """Return the test files that import ``module``, its own first; those of its folder where none does."""
    name = ".".join(module.relative_to(ROOT).with_suffix("").parts)
    own, others = [], []
    for file in sorted((ROOT / "tests").rglob("test_*.py")):
        text = file.read_text()
        if file.stem == f"test_{module.stem}":
            own.append(file)
        elif f"{name} import" in text or f"from {name.rpartition('.')[0]} import {module.stem}" in text:
            others.append(file)
    others.sort(key=lambda file: file.read_text().count("from kendama_cli"))
    beside = ROOT / "tests" / module.relative_to(ROOT / "kendama_cli").parent
    files = own + others or sorted(beside.glob("test_*.py"))
    return [str(file.relative_to(ROOT)) for file in files[:12]]


def pass_tests(module: Path, work: Path, *options: str) -> bool:
    """Return True if all tests of ``module`` pass in the copy within the time."""
    tree, home = str(work / "kendama"), str(work)
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", *options, *tests_of(module)]
    own = {"PYTHONPATH": tree, "NUMBA_CACHE_DIR": home, "KENDAMA_HOME": f"{home}/home", "NUMBA_BOUNDSCHECK": "1"}
    try:
        with (work / "tests.log").open("w") as log:
            return subprocess.call(command, cwd=tree, env=os.environ | own, stdout=log, timeout=TIMEOUT_S) == 0
    except subprocess.TimeoutExpired:
        return False


def outcome(mutant: Mutant, work: Path) -> str:
    """Run the tests of a mutant's module with it; where one fails, that one without it."""
    file = work / "kendama" / mutant.module.relative_to(ROOT)
    text = file.read_text()
    file.write_text(text[: mutant.start] + mutant.new + text[mutant.end :])
    lives = pass_tests(mutant.module, work)
    file.write_text(text)
    return "lives" if lives else "killed" if pass_tests(mutant.module, work, "--last-failed") else "fails without it"


def main() -> None:
    """Draw a sample of mutants, run those that have no result yet, and print the share killed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", default=FOLDERS)
    parser.add_argument("--sample", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--work", type=Path)
    asked = parser.parse_args()
    modules = [file for folder in asked.folders for file in sorted((ROOT / "kendama_cli" / folder).rglob("*.py"))]
    every = [mutant for module in modules if tests_of(module) for mutant in mutants(module)]
    drawn = random.Random(asked.seed).sample(sorted(every, key=str), min(asked.sample, len(every)))
    with tempfile.TemporaryDirectory() as scratch:
        work = (asked.work or Path(scratch)).resolve()
        shutil.copytree(ROOT, work / "kendama", ignore=shutil.ignore_patterns(".git", ".*_cache"), dirs_exist_ok=True)
        file = work / "results.txt"
        file.touch()
        for mutant in drawn:
            if f": {mutant}\n" not in file.read_text():
                line = f"{outcome(mutant, work)}: {mutant}"
                print(line, flush=True)
                with file.open("a") as results:
                    results.write(f"{line}\n")
        killed, lives = (file.read_text().count(f"{word}: ") for word in ("killed", "lives"))
    share = binomtest(killed, killed + lives).proportion_ci(method="wilson")
    print(f"killed {killed} of {killed + lives} [{share.low:.0%}, {share.high:.0%}], of {len(every)} mutants in all")


if __name__ == "__main__":
    main()
