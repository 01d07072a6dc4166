"""``kendama`` alone: three next steps that fit the current folder."""

from __future__ import annotations

import shlex
from pathlib import Path

from kendama_cli.cli import render
from kendama_cli.config.site import Site
from kendama_cli.store.home import run_names, run_number
from kendama_cli.version import __version__

RECORDINGS = (".csv", ".tsv", ".trc", ".bvh", ".c3d", ".mcap")


def welcome(site: Site) -> None:
    """Print where the runs are, and three commands that make sense next."""
    names = run_names(site.home)
    recordings = sorted(path.name for path in Path.cwd().iterdir() if path.suffix.lower() in RECORDINGS)
    render.text(f"kendama {__version__}: from a recorded swing to an arm that catches a ball in a cup\n")
    for command, what in _steps(names, recordings):
        render.text(f"  {command}\n      {what}")
    runs = f"{len(names)} run{'s' * (len(names) != 1)}" if names else "no runs yet"
    render.text("")
    render.prose(f"home: {render.short(site.home)} ({runs}); all commands: kendama --help")


def _steps(names: list[str], recordings: list[str]) -> list[tuple[str, str]]:
    swing = shlex.quote(f"capture.path={recordings[0]}") if recordings else ""
    if swing and not names:
        return [
            (f"kendama run -p imitation {swing}", "adapt this swing to an arm"),
            ("kendama explain capture.path", "formats, columns and units of recordings"),
            ("kendama run -p imitation", "the same with the bundled swings"),
        ]
    if names:
        other = ("kendama run robot=iiwa", "the same on another arm; finished stages are cached")
        return [
            ("kendama report", f"the page of the newest run, {run_number(names[-1])}"),
            ("kendama runs", "all runs with their metrics"),
            (f"kendama plan {swing}", "a run of the swing in this folder") if swing else other,
        ]
    return [
        ("kendama run -p imitation", "from bundled swings to an arm that catches"),
        ("kendama play", "record your own swing in the browser"),
        ("kendama explain adapt", "the meaning of a stage, setting or metric"),
    ]
