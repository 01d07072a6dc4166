"""Mutants of the numerics that the tests let live.

    python .ci/mutants.py --sample 100 --seed 1 [--work FOLDER] [FOLDER ...]

Each mutant is one changed operator, comparison, sign or number in a copy of the tree. With bounds of arrays checked the
test files of its module run, then those of the modules that import it, which often hold a kernel, until one fails; that
must pass without the mutant. Prints survivors and the share killed with its 95 % interval. With ``--work`` copy and
results stay there: the same command goes on, another seed adds to them. A survivor that changes no result is no fault.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from itertools import accumulate, chain
from pathlib import Path
from typing import NamedTuple

from scipy.stats import binomtest

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ["physics", "motion", "learning", "robot_model", "identification"]
FOLDERS += ["adaptation", "control", "simulation", "vision"]
SWAPS = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.Pow: "*", ast.Mod: "*", ast.FloorDiv: "*"}
TURNED = {ast.Lt: ">=", ast.LtE: "<", ast.Gt: "<=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "==", ast.IsNot: "is"}


class Mutant(NamedTuple):
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
    starts = [0, *accumulate(len(line) for line in text.splitlines(keepends=True))]

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
            yield Mutant(module, place(node)[0], place(node)[0] + 1, "+")
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            yield Mutant(module, *place(node), "1" if node.value == 0 else f"({node.value!r} * 2)")


def importers(module: Path, folder: str) -> list[Path]:
    """Return the files of ``folder`` that import ``module``."""
    package, _, name = ".".join(module.relative_to(ROOT).with_suffix("").parts).rpartition(".")
    line = re.compile(rf"from {package}(\.{name} import| import .*\b{name}\b)")
    return [file for file in sorted((ROOT / folder).rglob("*.py")) if line.search(file.read_text())]


def tests_of(module: Path) -> list[str]:
    """Return the test files that import ``module``, its own first; those of its folder where none does."""
    own, beside = f"test_{module.stem}.py", ROOT / "tests" / module.relative_to(ROOT / "kendama_cli").parent
    found = {file for file in importers(module, "tests") if file.match("test_*")} | {*(ROOT / "tests").rglob(own)}
    files = sorted(found, key=lambda file: (file.name != own, file.read_text().count("from kendama_cli"), file))
    return [str(file.relative_to(ROOT)) for file in (files or sorted(beside.glob("test_*.py")))[:12]]


def tests_around(module: Path) -> list[str]:
    """Return further test files: those of the modules that import ``module``."""
    found, own = [tests_of(user)[:4] for user in importers(module, "kendama_cli")], tests_of(module)
    return [test for test in dict.fromkeys(chain.from_iterable(found)) if test not in own][:16]


def pass_tests(tests: list[str], work: Path, *options: str) -> bool:
    """Return True if all ``tests`` pass in the copy within 900 s (0), or all are marked ``slow`` (5)."""
    tree, home = str(work / "kendama"), str(work)
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", *options, *tests]
    own = {"PYTHONPATH": tree, "NUMBA_CACHE_DIR": home, "KENDAMA_HOME": f"{home}/home", "NUMBA_BOUNDSCHECK": "1"}
    try:
        with (work / "tests.log").open("w") as log:
            return subprocess.call(command, cwd=tree, env=os.environ | own, stdout=log, timeout=900) in {0, 5}
    except subprocess.TimeoutExpired:
        return False


def outcome(mutant: Mutant, work: Path) -> str:
    """Run the tests that a mutant meets; where one fails, that one without it."""
    file, text = work / "kendama" / mutant.module.relative_to(ROOT), mutant.module.read_text()
    file.write_text(text[: mutant.start] + mutant.new + text[mutant.end :])
    rings = tests_of(mutant.module), tests_around(mutant.module)
    failed = next((tests for tests in rings if tests and not pass_tests(tests, work)), None)
    file.write_text(text)
    return "lives" if not failed else "killed" if pass_tests(failed, work, "--last-failed") else "fails without it"


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
        with file.open("a", buffering=1) as results:
            for mutant in drawn:
                if f": {mutant}\n" not in file.read_text():
                    line = f"{outcome(mutant, work)}: {mutant}"
                    print(line, flush=True)
                    print(line, file=results)
        killed, lives = (file.read_text().count(f"{word}: ") for word in ("killed", "lives"))
    share = binomtest(killed, killed + lives).proportion_ci(method="wilson")
    print(f"killed {killed} of {killed + lives} [{share.low:.0%}, {share.high:.0%}], of {len(every)} mutants in all")


if __name__ == "__main__":
    main()
