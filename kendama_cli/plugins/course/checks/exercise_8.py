"""Grades exercise 8: a learner of one's own, plugged in, conforming, and ranked."""

from __future__ import annotations

import importlib.metadata
import json
import subprocess
import sys

from kendama_cli.plugins.course.work import Work, WrongAnswerError, require

SEEDS = 3
FIRST_SEED = 40_000
"""Seeds that the exercise does not name."""


def plugged_in(work: Work) -> None:
    """Check that the entry point is found, and that its object can be imported."""
    points = [one for one in importlib.metadata.entry_points(group="kendama.learners") if one.name == "mine"]
    hint = "run 'pip install -e my-learner' in the notebook's folder, with the Python that kendama lives in"
    require(bool(points), f"no learner 'mine' is installed; {hint}")
    try:
        points[0].load()
    except Exception as error:
        raise WrongAnswerError(f"the learner 'mine' cannot be imported: {type(error).__name__}: {error}") from error
    choice = work.folder / "conf" / "learn" / "learner" / "mine.yaml"
    require(choice.is_file(), f"{choice} is gone; it chooses the learner, and belongs beside the notebook")


def conforming(work: Work) -> None:
    """Check by our suite for learners."""
    plugged_in(work)
    words = ["-m", "pytest", "-q", "-p", "kendama_cli.conformance", "-p", "no:cacheprovider", "-p", "no:xdist"]
    suite = ["--suite", "learner", "--override", "learn/learner=mine"]
    done = subprocess.run(
        [sys.executable, *words, *suite], cwd=work.folder, capture_output=True, text=True, timeout=300, check=False
    )
    if done.returncode != 0:
        lines = [
            line for line in (done.stdout + done.stderr).splitlines() if line.startswith(("E  ", "FAILED", "ERROR"))
        ]
        first = lines[0].removeprefix("E").strip() if lines else (done.stdout + done.stderr).strip()[-200:]
        raise WrongAnswerError(
            f"the suite of learners fails: {first}; its whole output is in the notebook's last cell but one"
        )


def ahead_of_chance(work: Work) -> None:
    """Check for a result above the baseline on seeds that were not named."""
    plugged_in(work)
    words = [
        "course",
        "board",
        "mine",
        "random_replay",
        "--json",
        "--seeds",
        str(SEEDS),
        "--first-seed",
        str(FIRST_SEED),
    ]
    done = subprocess.run(
        [sys.executable, "-m", "kendama_cli.cli.main", *words],
        cwd=work.folder,
        capture_output=True,
        text=True,
        timeout=800,
        check=False,
    )
    if done.returncode != 0:
        raise WrongAnswerError(f"the board cannot be made: {done.stderr.strip().splitlines()[-1]}")
    places = {one["learner"]: (number, one) for number, one in enumerate(json.loads(done.stdout)["places"], 1)}
    mine, null = places["mine"], places["random_replay"]
    require(
        mine[0] < null[0],
        f"on {SEEDS} seeds 'mine' needs {mine[1]['rollouts_to_solved']:.0f} rollouts to solved and its policies catch "
        f"{mine[1]['caught_rate']:.2f}; the baseline {null[1]['rollouts_to_solved']:.0f} and "
        f"{null[1]['caught_rate']:.2f}: let propose() use what was nearly caught",
    )


CHECKS = {1: plugged_in, 2: conforming, 3: ahead_of_chance}
